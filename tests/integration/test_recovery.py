"""The missions' recovery with real dynamics: faults are made to happen, and the world is asked what came of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco import MujocoBackend
from glotouch_bt.faults import FaultInjector
from glotouch_bt.faults.plan import check_plan
from glotouch_bt.faults.run_listener import ListeningRecord
from glotouch_bt.mission.execution.runner import Outcome, run_mission
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read.library import SkillRegistry, shipped_root
from glotouch_bt.mission.read.worlds import load_conditions
from glotouch_bt.mission.read.yaml_source import parse_yaml
from glotouch_bt.mission.record.run_summary import NullRecord
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD
from glotouch_bt.robot.simulation.referee import Referee
from glotouch_bt.skill import Out, Skill, SkillFailed, SkillRun
from glotouch_skills.common.planning.grasp_plan import GraspPlan

SUBTREES = shipped_root() / "subtrees"
WIDE, NARROW = (0.050, 0.040, 0.060), (0.030, 0.030, 0.060)


class Notes(NullRecord):
    """What happened: the outcomes of leaves in order, and every event."""

    def __init__(self) -> None:
        self.ends: list[tuple[str, str]] = []
        self.events: list[tuple[str, Mapping[str, object]]] = []

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, Any, Any]]) -> None:
        self.ends += [(path.rsplit("/", 1)[-1], new.value) for path, _, new in changes]

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        self.events.append((kind, data))

    def how_often(self, leaf: str, ended: str) -> int:
        """How often a leaf (whatever its number) ended so."""
        return sum(name.rstrip(" 0123456789") == leaf and how == ended for name, how in self.ends)

    def codes(self) -> list[str]:
        """Codes of all failures, in order."""
        return [str(data["code"]) for kind, data in self.events if kind == "failure"]


@dataclass
class Ended:
    """A mission that has ended, and the world it left."""

    outcome: Outcome
    notes: Notes
    referee: Referee
    injector: FaultInjector
    peak_force_N: float
    height_m: float  # of the pads' mid-point above the container's floor
    held: list[str] = field(default_factory=list)

    @property
    def cause(self) -> str:
        """Code of the root reason."""
        reason = self.outcome.chain[-1].reason
        return "" if reason is None else reason.code


Run = Callable[..., Ended]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Run a tree (YAML text) under a fault plan (lines of its list), nominal conditions."""

    def ended(
        tree: str,
        faults: str,
        places: Mapping[str, tuple[float, float, float]],
        sizes: Mapping[str, tuple[float, float, float]],
        stubs: Mapping[str, type[Skill]] | None = None,
        seed: int = 1,
    ) -> Ended:
        folder = tmp_path / "objects"
        folder.mkdir()
        for name, size in sizes.items():
            trimesh.creation.box(size).export(folder / f"{name}.stl")
        file = tmp_path / "mission.yaml"
        body = "\n".join("  " + line for line in tree.replace("SUBTREES", str(SUBTREES)).strip("\n").splitlines())
        file.write_text(f"mission: trial\nworld: container_five\ntree:\n{body}\n")
        mission = load_mission(file, skills={**SkillRegistry(), **(stubs or {})}, objects=folder)
        plan = check_plan(parse_yaml(f"faults: trial\nplan:\n{faults}", "plan.yaml"), mission.spec, mission.name)
        backend = MujocoBackend()
        inner = backend.open(mission.world, load_conditions("nominal"), seed, {"layout": places})
        notes = Notes()
        with FaultInjector(inner, plan, seed, disturber=backend.disturber(inner)) as robot:
            outcome = run_mission(mission, robot, ListeningRecord(notes, robot))
            referee = backend.referee(inner)
            assert referee is not None
            floor = mission.world.container.pose_B_K.position_m[2]
            done = Ended(
                outcome=outcome,
                notes=notes,
                referee=referee,
                injector=robot,
                peak_force_N=referee.peak_force_N(),
                height_m=float(inner.observe().pose_B_P.position_m[2] - floor),
                held=[o.name for o in referee.objects() if o.in_gripper],
            )
        assert outcome.status != "aborted", outcome.reasons
        assert done.peak_force_N < inner.limits.hard_force_N
        for proof in robot.proofs():
            assert proof.changes, "a fault that altered nothing shows nothing"
        return done

    return ended


def planned(*plans: GraspPlan) -> type[Skill]:
    """A `match` that was sure: each time it is asked the next plan."""
    left = list(plans)

    class Sure(Skill):
        """Writes a plan. FAILURE `not_recognised`: it has no more."""

        POSTCONDITIONS: ClassVar = {}
        plan = Out(GraspPlan, "how to grasp it")
        recognised = Out(bool, "it has a plan", always=True)
        candidates = Out(tuple, "what is known")
        touchsets = Out(tuple, "what was felt", element=TouchSet)

        def run(self) -> SkillRun:
            yield HOLD
            self.candidates, self.touchsets, self.recognised = (), (), bool(left)
            if not left:
                raise SkillFailed("not_recognised", "no plan is left")
            self.plan = left.pop(0)

    return Sure


def upright(index: int, x: float, y: float, width_m: float, opening_m: float = 0.07) -> GraspPlan:
    """Pads 25 mm above the floor, closing along y_K."""
    return GraspPlan(index, np.array([x, y, 0.025]), 0.0, width_m, opening_m)


HOLD_IT = """
sequence:
  - sure
  - subtree: {file: SUBTREES/hold.yaml, ports: {plan: plan, candidates: candidates}}
"""
ONE: Any = {"places": {"block": (0.02, 0.05, 0.0)}, "sizes": {"block": WIDE}}


def test_what_fell_while_it_was_lifted_is_grasped_again(run: Run) -> None:
    stubs = {"sure": planned(upright(0, 0.02, 0.05, 0.040))}
    done = run(HOLD_IT, "  - {fault: grip_drop, when: {node: lift, after_s: 1.0}, for: 1 s}", stubs=stubs, **ONE)
    assert done.outcome.status == "success", done.outcome.reasons
    assert done.held == ["block"]
    assert done.notes.how_often("grasp", "SUCCESS") == 2
    assert set(done.notes.codes()) <= {"lost", "slipped", "off_zero"}


def test_a_wrist_that_went_off_zero_is_zeroed_and_the_object_weighed_again(run: Run) -> None:
    """Two newtons up: the block of 1.5 to 3.9 N seems to be gone, or nearly."""
    stubs = {"sure": planned(upright(0, 0.02, 0.05, 0.040))}
    faults = "  - {fault: wrench_bias, with: {force_N: [0, 0, -4.0]}, when: {node: lift}, for: ever}"
    done = run(HOLD_IT, faults, stubs=stubs, **ONE)
    assert done.outcome.status == "success", done.outcome.reasons
    assert done.held == ["block"]
    assert "lost" in done.notes.codes()
    (weight,) = [d["weight_N"] for k, d in done.notes.events if k == "lift"][-1:]
    (block,) = done.referee.objects()
    assert weight == pytest.approx(9.81 * block.mass_kg, abs=0.2)


def test_a_wrong_object_is_put_back_and_the_next_is_taken(run: Run, tmp_path: Path) -> None:
    """Two plans: the first takes the narrow block for the wide one."""
    match = planned(upright(0, 0.02, -0.06, 0.040), upright(1, 0.02, 0.05, 0.040))
    tree = """
sequence:
  - sure
  - tare
  - subtree:
      file: SUBTREES/take_target.yaml
      parameters: {target: block}
      ports: {candidates: candidates, touchsets: touchsets}
"""
    faults = "  - {fault: gel_offset, when: {node: hold_check}, for: node}"
    sizes, places = {"block": WIDE, "other": NARROW}, {"block": (0.02, 0.05, 0.0), "other": (0.02, -0.06, 0.0)}
    stubs = {"sure": planned(upright(0, 0.0, 0.0, 0.040)), "match": with_target(match)}
    done = run(tree, faults, places, sizes, stubs)
    assert done.outcome.status == "success", done.outcome.reasons
    assert done.held == ["block"]
    assert "wrong_object" in done.notes.codes()
    other = next(o for o in done.referee.objects() if o.name == "other")
    assert np.linalg.norm(other.pose_B_O.position_m[:2] - [0.62, -0.06]) < 0.01, "it stands where it was"
    assert other.pose_B_O.rotation[2, 2] > 0.99, "upright"


def with_target(skill: type[Skill]) -> type[Skill]:
    """The same skill with the parameters of `match`."""
    return type("Given", (skill,), {"Params": SkillRegistry()["match"].Params})


def test_what_is_gone_cannot_be_held_and_the_first_reason_is_kept(run: Run) -> None:
    tree = """
selector:
  - sequence:
      - sure
      - subtree: {file: SUBTREES/hold.yaml, ports: {plan: plan, candidates: candidates}}
  - fail: stow
"""
    stubs = {"sure": planned(upright(0, 0.02, 0.05, 0.040))}
    done = run(tree, "  - {fault: object_removed, when: {node: grasp}, for: ever}", stubs=stubs, **ONE)
    assert (done.outcome.status, done.cause) == ("failure", "no_grasp"), done.outcome.reasons
    assert not done.held
    assert done.height_m > 0.14


def test_jaws_that_stalled_on_the_handle_close_again(run: Run) -> None:
    tree = "sequence:\n  - subtree: {file: SUBTREES/take_probe.yaml, ports: {tool: tool}}\n  - tool_return"
    done = run(tree, "  - {fault: grip_short, with: {min_m: 0.03}, when: {node: tool_pickup}, for: node}", **ONE)
    assert done.outcome.status == "success", done.outcome.reasons
    assert done.notes.codes() == ["no_probe"]
    assert done.referee.probe_in_holder()


class GivesUp(Skill):
    """Fails."""

    def run(self) -> SkillRun:
        yield HOLD
        raise SkillFailed("given_up", "it is over")


def test_whatever_fails_the_probe_goes_back_and_the_first_reason_is_kept(run: Run) -> None:
    tree = """
selector:
  - sequence:
      - subtree: {file: SUBTREES/take_probe.yaml}
      - gives_up
  - fail: stow
"""
    faults = "  - {fault: wrench_bias, with: {force_N: [2, 0, 3]}, when: {node: gives_up}, for: ever}"
    done = run(tree, faults, stubs={"gives_up": GivesUp}, **ONE)
    assert (done.outcome.status, done.cause) == ("failure", "given_up"), done.outcome.reasons
    assert done.referee.probe_in_holder()


EXPLORE = """
selector:
  - subtree:
      file: SUBTREES/find_objects.yaml
      parameters: {expected_objects: EXPECTED}
      ports: {candidates: candidates}
  - fail: stow
"""


@pytest.mark.parametrize("masked", ["false", "true"], ids=["jaws and weight", "weight and floor"])
def test_a_dropped_probe_is_noticed_and_nothing_is_found_without_it(run: Run, masked: str) -> None:
    faults = (
        f"  - {{fault: grip_drop, with: {{masked: {masked}}}, when: {{node: guarded_sweep, after_s: 2}}, for: ever}}"
    )
    done = run(EXPLORE.replace("EXPECTED", "1"), faults, **ONE)
    assert (done.outcome.status, done.cause) == ("failure", "tool_lost"), done.outcome.reasons
    assert not done.referee.probe_in_holder()
    assert done.height_m > 0.14
    assert done.outcome.end_s < 80.0, "no search without a probe"


@pytest.mark.study
def test_a_probe_dropped_later_leaves_what_was_found(run: Run) -> None:
    faults = (
        "  - {fault: grip_drop, with: {duration_s: 3}, when: {node: guarded_sweep, visit: 2, after_s: 2}, for: ever}"
    )
    done = run(EXPLORE.replace("EXPECTED", "2"), faults, {"block": (0.02, -0.12, 0.0)}, {"block": WIDE})
    assert done.outcome.status == "success", done.outcome.reasons
    assert "tool_lost" in done.notes.codes()
    assert done.outcome.summary.candidates


@pytest.mark.study
def test_a_probe_that_slipped_in_the_jaws_is_put_back_and_taken_anew(run: Run) -> None:
    """The jaws open a little over the floor and close again on the probe, which has sunk by more than a centimetre."""
    faults = """
  - fault: grip_drop
    with: {opening_m: 4 mm, duration_s: 0.15}
    when: {node: guarded_sweep, after_s: 1.0, height_below_m: -0.05}
    for: ever
"""
    done = run(EXPLORE.replace("EXPECTED", "1"), faults, {"block": (0.02, 0.0, 0.0)}, {"block": WIDE})
    assert done.outcome.status == "success", done.outcome.reasons
    assert "tool_slipped" in done.notes.codes()
    assert done.referee.probe_in_holder()


@pytest.mark.study
def test_jaws_that_report_wrongly_do_not_end_a_search_with_a_held_probe(run: Run) -> None:
    faults = "  - {fault: grip_misreport, with: {aperture_m: 6 mm}, when: {node: guarded_sweep, after_s: 2}, for: ever}"
    done = run(EXPLORE.replace("EXPECTED", "1"), faults, {"block": (0.02, -0.06, 0.0)}, {"block": WIDE})
    assert done.outcome.status == "success", done.outcome.reasons
    assert done.notes.codes()[:1] == ["tool_lost"]
    assert done.referee.probe_in_holder()


def knowing(candidate: Candidate) -> type[Skill]:
    """A skill that knows a candidate without searching."""

    class Known(Skill):
        """Writes the candidate."""

        candidates = Out(tuple, "what was found", element=Candidate)

        def run(self) -> SkillRun:
            yield HOLD
            self.candidates = (candidate,)

    return Known


def test_what_frozen_gels_did_not_feel_is_touched_again(run: Run, found: Any) -> None:
    """One image comes again and again while the only candidate is squeezed; then the jaws touch where it tells most."""
    tree = """
sequence:
  - known
  - tare
  - subtree: {file: SUBTREES/squeeze_all.yaml, ports: {candidates: candidates, touchsets: touchsets}}
  - subtree:
      file: SUBTREES/take_target.yaml
      parameters: {target: block}
      ports: {candidates: candidates, touchsets: touchsets}
"""
    faults = "  - {fault: touch_frozen, when: {node: squeeze}, for: node}"
    done = run(tree, faults, stubs={"known": knowing(found.box((0.02, 0.05), WIDE[:2], height_m=WIDE[2]))}, **ONE)
    assert done.outcome.status == "success", done.outcome.reasons
    assert done.held == ["block"]
    assert "not_recognised" in done.notes.codes()
    assert done.notes.how_often("touch_next", "SUCCESS") > 1


def test_a_squeeze_spoilt_by_the_wrist_is_made_again(run: Run, found: Any) -> None:
    """Fourteen newtons that are not there: every closure looks wedged and is given up."""
    done = run(
        "sequence:\n  - known\n  - subtree: {file: SUBTREES/squeeze_all.yaml, ports: {candidates: candidates}}",
        "  - {fault: wrench_bias, with: {force_N: [14, 0, 0]}, when: {node: squeeze, after_s: 5}, for: ever}",
        stubs={"known": knowing(found.box((0.02, 0.05), WIDE[:2], height_m=WIDE[2]))},
        **ONE,
    )
    assert done.outcome.status == "success", done.outcome.reasons
    assert "off_zero" in done.notes.codes()
    assert done.notes.how_often("squeeze", "FAILURE") == 1
    assert done.notes.how_often("squeeze", "SUCCESS") == 1
