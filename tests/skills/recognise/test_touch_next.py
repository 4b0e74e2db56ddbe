"""touch_next on the fake robot: one closure a call, in order of what tells most, until it is known."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from py_trees.blackboard import Blackboard
from py_trees.common import Status

import glotouch_skills.recognise.closure_space as closure_space
import glotouch_skills.recognise.touch_next as module
from glotouch_bt.perception.recognition import PARTS, Closure, Match, ProbeTouch, Ranking
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import MotionRefused
from glotouch_skills.common.hand import NoSpace
from glotouch_skills.recognise.touch_next import TouchNext

WIDTH = 0.05


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("stl")
    trimesh.creation.cylinder(0.5 * WIDTH, 0.06, sections=48).export(path / "can.stl")
    return path


class Oracle:
    """A matcher that knows after `enough` layers on candidate `right`; it values its closures most."""

    def __init__(self, right: int | None, enough: int, evidence: float = 9.0) -> None:
        self.right, self.enough, self.evidence = right, enough, evidence

    def infer_belief(self, model, touchsets) -> SimpleNamespace:
        felt = {t.candidate.index: sum(layer.stable for layer in t.layers) for t in touchsets}
        known = sum(felt.values()) >= self.enough if self.right is None else felt[self.right] >= self.enough
        n = len(felt)
        p = {i: (float(i == self.right) if known else 1.0 / (n + 1)) for i in felt}
        matches = [Match(i, 1.0 - p[i], {}, None, (0, 0, 0), float(felt[i]), p[i]) for i in felt]
        matches.sort(key=lambda m: m.loss)
        accepted = known and self.right is not None
        return SimpleNamespace(
            params=LikelihoodParams(),
            touchsets=tuple(touchsets),
            ranking=Ranking(tuple(matches), 1.0, accepted, (), 1.0 - sum(p.values())),
        )

    def expected_gain(self, belief, closures) -> np.ndarray:
        return np.array([0.5 if c.candidate == self.right or self.right is None else 0.1 for c in closures])


@pytest.fixture
def make(bench, found, folder, monkeypatch):
    def make_one(
        oracle, things=None, grip_width_m=WIDTH, stuff=(), tip_P_m=0.13, probed=None, felt=None, refused=None,
        doubtful=None, **params
    ):  # fmt: skip
        b = bench(grip_width_m=grip_width_m, things=stuff, tip_P_m=tip_P_m)
        b.context.world = replace(b.world, objects=replace(b.world.objects, folder=folder))
        monkeypatch.setattr(module.recognition, "infer_belief", oracle.infer_belief)
        monkeypatch.setattr(module.recognition, "expected_gain", oracle.expected_gain)
        things = things or (found.round((0.0, -0.08), 0.025), found.round((0.0, 0.08), 0.025, index=1))
        optional = {"probed": probed, "felt": felt, "refused_before": refused, "doubtful_before": doubtful}
        given = {"candidates": things} | {k: v for k, v in optional.items() if v is not None}
        return b, b.make(TouchNext, inputs=given, target="can", **params)

    return make_one


def repeat(b, skill, limit: int = 60) -> int:
    """As the tree's repeat does; how many passes it took."""
    for n in range(limit):
        b.run(skill)
        assert skill.status is Status.SUCCESS, skill.feedback_message
        if skill.decided:
            return n + 1
    raise AssertionError("never decided")


def pads_height(b) -> float:
    return float(b.world.container.pose_B_K.inverse().apply(b.arm.pose_B_P.position_m)[2])


def test_it_touches_where_it_tells_most_and_stops_when_it_knows(make) -> None:
    b, skill = make(Oracle(right=1, enough=3))
    assert repeat(b, skill) == 4
    first, second = skill.touchsets
    assert (len(first.layers), len(second.layers)) == (0, 3)
    (sequence,) = second.sequences
    heights = [layer.height_m for layer in sequence.layers]
    assert heights == sorted(heights), "one stance, from below upwards"
    assert [layer.aperture_m for layer in sequence.layers] == pytest.approx([WIDTH] * 3, abs=1e-6)
    np.testing.assert_allclose(sequence.layers[-1].position_K_m, [0.0, 0.08], atol=1e-4)
    closures = b.of_kind("closure")
    assert [c["number"] for c in closures] == [1, 2, 3]
    assert all(isinstance(c["chosen"], Closure) and c["chosen"].gain_nats == 0.5 for c in closures)
    (decided,) = b.of_kind("decided")
    assert (decided["closures"], decided["stances"], decided["candidates"]) == (3, 1, 1)
    assert [e["touchset"].candidate.index for e in b.of_kind("touchset")] == [1]
    assert pads_height(b) > 0.13, "the hand is high again"
    assert not [o for o in b.arm.scene.obstacles if o.startswith("candidate")]


def test_jaws_open_less_far_where_neighbours_leave_less_space(make, monkeypatch) -> None:
    def require_clear(arm, pose, opening_m, margin_m=0.0) -> None:
        if opening_m > WIDTH + 0.012:
            raise MotionRefused("pose", "a neighbour is near")

    monkeypatch.setattr(closure_space, "require_clear", require_clear)
    b, skill = make(Oracle(right=1, enough=3))
    b.run(skill)
    assert len(skill.touchsets[1].layers) == 1
    assert skill._down.at.opening_m == pytest.approx(WIDTH + 0.010, abs=1e-6)
    assert not skill.refused


def test_none_of_them(make) -> None:
    """The oracle is sure after one closure that the target is absent: a decision, too, once both have been felt and the
    likeliest, here the first, as often as a pose takes."""
    b, skill = make(Oracle(right=None, enough=1))
    assert repeat(b, skill) == 4
    assert [len(t.layers) for t in skill.touchsets] == [2, 1]
    assert "none of them" in b.of_kind("decided")[0]["why"]


def test_it_ends_when_nothing_can_help(make) -> None:
    """Gains below the least are not worth a closure; only the likeliest, here the first, is felt for its pose."""
    b, skill = make(Oracle(right=1, enough=3), min_gain_nats=0.6)
    assert repeat(b, skill) == 3
    assert [len(t.layers) for t in skill.touchsets] == [2, 0]
    assert "no closure" in b.of_kind("decided")[0]["why"]


def test_sure_but_hardly_felt_is_touched_again(make) -> None:
    """Known from the first closure on, but a grasp needs a pose: the candidate itself is touched on."""
    oracle = Oracle(right=1, enough=1)

    def gain(belief, closures):
        felt = any(t.layers for t in belief.touchsets)
        return np.array([0.5 if c.candidate == 1 and not felt else 0.0 for c in closures])

    oracle.expected_gain = gain
    b, skill = make(oracle)
    repeat(b, skill)
    assert [len(t.layers) for t in skill.touchsets] == [0, 2]


def measured(*indices: int) -> tuple[ProbeTouch, ...]:
    return tuple(ProbeTouch(i, part) for i in indices for part in PARTS)


def test_what_tells_most_but_was_not_measured_is_left_to_the_probe(make) -> None:
    b, skill = make(Oracle(right=1, enough=3), probed=measured(0))
    repeat(b, skill)
    assert [len(t.layers) for t in skill.touchsets][1] == 0
    assert "candidate 1 would tell most, once the probe has measured it" in b.of_kind("decided")[0]["why"]


def test_it_may_be_told_to_touch_what_was_not_measured(make) -> None:
    b, skill = make(Oracle(right=1, enough=3), probed=measured(0), unmeasured=True)
    repeat(b, skill)
    assert [len(t.layers) for t in skill.touchsets] == [0, 3]


def test_touches_are_kept_when_a_candidate_is_measured_anew(make, found) -> None:
    things = found.round((0.0, -0.08), 0.025), found.round((0.0, 0.08), 0.025, index=1)
    b, skill = make(Oracle(right=1, enough=3), things)
    b.run(skill)
    higher = replace(things[1], height_m=things[1].height_m + 0.01)
    _, again = make(Oracle(right=1, enough=3), (things[0], higher), felt=skill.touchsets)
    b.run(again)
    assert again.touchsets[1].candidate.height_m == higher.height_m
    assert len(again.touchsets[1].layers) >= 1


def test_a_candidate_that_is_gone_is_left_alone(make) -> None:
    """Nothing is ever felt: each candidate gets a few closures, then it ends."""
    b, skill = make(Oracle(right=1, enough=3), grip_width_m=None)
    repeat(b, skill)
    assert [len(t.layers) for t in skill.touchsets] == [module.MAX_VAIN_CLOSURES] * 2
    assert not any(layer.stable for t in skill.touchsets for layer in t.layers)
    assert skill.doubtful == (0, 1), "they are not where they were traced"


def test_it_closes_beside_a_stance_where_the_hand_does_not_fit(make, monkeypatch) -> None:
    """Nothing fits at the yaws of the options, all multiples of 30 degrees; a turn of 5 degrees away, it does."""

    def require_clear(arm, pose, opening_m, margin_m=0.0) -> None:
        off_deg = np.rad2deg(abs(math.remainder(pose.yaw_rad, math.radians(30.0))))
        if off_deg < 1.0:
            raise MotionRefused("pose", "a neighbour is near")

    monkeypatch.setattr(closure_space, "require_clear", require_clear)
    b, skill = make(Oracle(right=1, enough=1))
    repeat(b, skill)
    (sequence,) = skill.touchsets[1].sequences
    assert abs(math.remainder(sequence.yaw_rad, math.radians(30.0))) == pytest.approx(math.radians(5.0), abs=1e-3)
    turned = b.of_kind("closure")[0]["chosen"].yaw_K_rad - sequence.yaw_rad
    assert math.remainder(turned, math.pi) == pytest.approx(0.0, abs=1e-6)
    assert not skill.refused


def test_the_record_says_what_keeps_closures_from_fitting(make, monkeypatch) -> None:
    def require_clear(arm, pose, opening_m, margin_m=0.0) -> None:
        raise MotionRefused("pose", "finger would hit candidate 0")

    monkeypatch.setattr(closure_space, "require_clear", require_clear)
    b, skill = make(Oracle(right=1, enough=3))
    assert repeat(b, skill) == 1
    (note,) = (n["text"] for n in b.of_kind("note") if "candidate 1" in n["text"])
    assert note.endswith("of the closures on candidate 1 do not fit: pose refused: finger would hit candidate 0")
    assert len([key for key in skill.refused if key[0] == 1]) == int(note.split()[0])


def test_a_stance_close_by_where_the_fingers_meet_something_is_not_tried_again(make, things, monkeypatch) -> None:
    """The hand fits only beside the planned stances, and comes down on something there: each is tried once."""

    def require_clear(arm, pose, opening_m, margin_m=0.0) -> None:
        if np.rad2deg(abs(math.remainder(pose.yaw_rad, math.radians(30.0)))) < 1.0:
            raise MotionRefused("pose", "a neighbour is near")

    monkeypatch.setattr(closure_space, "require_clear", require_clear)
    b, skill = make(Oracle(right=1, enough=3), stuff=[things.floor(0.045)], tip_P_m=0.022)
    passes = repeat(b, skill, limit=20)
    met = [n for n in b.of_kind("note") if "was not made" in n["text"]]
    assert len(met) == len(set(skill.refused)) == passes - 1


@pytest.mark.parametrize(("refusal", "cramped"), [(NoSpace, (1,)), (MotionRefused, ())])
def test_it_says_which_candidate_lacks_space(make, monkeypatch, refusal: type[MotionRefused], cramped) -> None:
    """Closures on candidate 1 would tell most and only lack space, or are out of reach: space would not help then."""

    def require_clear(arm, pose, opening_m, margin_m=0.0) -> None:
        if pose.position_m[1] > 0.0:
            raise refusal("pose", "a neighbour is near")

    monkeypatch.setattr(closure_space, "require_clear", require_clear)
    oracle = Oracle(right=1, enough=3)
    b, skill = make(oracle, min_gain_nats=0.3)
    repeat(b, skill)
    assert (skill.cramped, skill.lacks_space) == (cramped, bool(cramped))
    assert b.of_kind("decided")[0]["cramped"] == cramped
    _, later = make(oracle, min_gain_nats=0.3, felt=skill.touchsets, refused=skill.refused)
    repeat(b, later)
    assert later.cramped == cramped, "a later node tries the refused closures no more, but knows what they lack"
    _, content = make(oracle, min_gain_nats=0.6, felt=skill.touchsets, refused=skill.refused)
    repeat(b, content)
    assert content.cramped == (), "closures that tell too little need no space"


def test_what_lacks_space_is_known_while_others_are_touched(make, monkeypatch) -> None:
    """A mission that ends the closures by their number can still make space."""

    def require_clear(arm, pose, opening_m, margin_m=0.0) -> None:
        if pose.position_m[1] > 0.0:
            raise NoSpace("pose", "a neighbour is near")

    monkeypatch.setattr(closure_space, "require_clear", require_clear)
    b, skill = make(Oracle(right=1, enough=3))
    b.run(skill)
    assert not skill.decided
    assert (skill.cramped, skill.lacks_space) == ((1,), True)


def test_a_likely_candidate_that_the_jaws_do_not_span_is_doubted(make, found) -> None:
    """The target fits between the jaws, so this outline holds contacts of other objects."""
    wide = found.box((0.0, 0.08), (0.12, 0.10), index=1)
    b, skill = make(Oracle(right=1, enough=0), things=(found.round((0.0, -0.08), 0.025), wide))
    repeat(b, skill)
    assert skill.doubtful == (1,)


def test_nothing_lacks_space_when_it_is_known(make) -> None:
    b, skill = make(Oracle(right=1, enough=3))
    repeat(b, skill)
    assert (skill.cramped, skill.lacks_space) == ((), False)


def test_fingers_on_something_cost_a_choice_not_the_mission(make, things) -> None:
    """A later `touch_next` node reads the refused closures and does not try them again."""
    floor = things.floor(0.045)
    b, first = make(Oracle(right=1, enough=3), stuff=[floor], tip_P_m=0.022)
    repeat(b, first)
    assert sum(len(t.layers) for t in first.touchsets) == 0
    assert first.doubtful == (0, 1), "what the fingers met is not where it was traced"
    assert b.of_kind("note")
    assert pads_height(b) > 0.13
    assert {key[0] for key in first.refused} == {0, 1}
    known = {"felt": first.touchsets, "refused": first.refused}
    _, second = make(Oracle(right=1, enough=3), stuff=[floor], tip_P_m=0.022, **known)
    assert repeat(b, second) == 1
    assert second.refused == first.refused


def test_what_is_felt_where_it_was_traced_is_doubted_no_more(make) -> None:
    """Candidate 1 is closed on and stays in its place; the other one is not touched."""
    b, skill = make(Oracle(right=1, enough=3), doubtful=(0, 1))
    repeat(b, skill)
    assert not b.of_kind("object_moved")
    assert skill.doubtful == (0,)


def test_fingers_on_a_low_ledge_close_above_it(make, things) -> None:
    """The ledge stops the pads at 32 mm, 11 mm above the lowest closure of a can of 60 mm."""
    b, skill = make(Oracle(right=1, enough=1), stuff=[things.floor(0.005)], tip_P_m=0.022)
    repeat(b, skill)
    assert [len(t.layers) for t in skill.touchsets] == [0, 2]
    assert skill.touchsets[1].layers[0].height_m == pytest.approx(0.035, abs=1e-3)
    assert not skill.refused


def test_what_did_not_fit_is_tried_again_when_a_neighbour_is_known_better(make, found) -> None:
    """A closure that met something stays refused; one that only did not fit is tried again."""
    one, other = found.round((0.0, -0.08), 0.025), found.round((0.0, 0.08), 0.025, index=1)
    felt = tuple(TouchSet(c, ()) for c in (one, other))
    refused = ((0, 0, 27, 0, True), (0, 30, 27, 0, False))
    known = {"felt": felt, "refused": refused, "doubtful": ()}
    b, same = make(Oracle(right=1, enough=0), things=(one, other), **known)
    b.run(same)
    assert same.refused == refused
    b, better = make(Oracle(right=1, enough=0), things=(one, replace(other, height_m=0.09)), **known)
    b.run(better)
    assert better.refused == refused[:1]


def test_touch_next__no_candidates__or_unusable_target(make, found) -> None:
    b, skill = make(Oracle(right=1, enough=3), things=(found.round((0, 0), 0.025),))
    b.run(skill, 0)
    empty = b.make(TouchNext, inputs={"candidates": ()}, target="can")
    b.run(empty)
    assert (empty.status, empty.reason.code) == (Status.FAILURE, "no_candidates")


def test_broken_off_anywhere_it_goes_on(make) -> None:
    """After a break the hand stands anywhere: it rises first, and what was felt before is kept."""
    b, skill = make(Oracle(right=1, enough=2))
    total = 0
    while b.tick(skill) is Status.RUNNING:
        total += 1
    b, skill = make(Oracle(right=1, enough=2))
    b.run(skill)
    keys = skill.default_keys()
    assert keys["felt"] == keys["touchsets"] == "touchsets"
    b.run(skill, 60)
    b.preempt(skill)
    assert repeat(b, skill) >= 2
    assert len(skill.touchsets[1].layers) >= 2
    for k in np.linspace(1, total - 2, 4).astype(int):
        b, skill = make(Oracle(right=1, enough=2))
        b.run(skill, int(k))
        b.preempt(skill)
        repeat(b, skill)
        assert len(skill.touchsets[1].layers) == 2
    Blackboard.clear()
