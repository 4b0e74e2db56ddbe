"""`bench forces`: what is drawn, the figures of rows that are made up, and what a user may get wrong."""

from __future__ import annotations

import json
from collections import Counter
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from glotouch_bt.campaign import Campaign, WorkerLost
from glotouch_bt.cli import app
from glotouch_bt.faults import CATALOGUE, FaultPlan, check_plan
from glotouch_bt.mission.read import limits_of, parse_yaml
from glotouch_bt.validation.forces import campaign as forces_campaign
from glotouch_bt.validation.forces import trial as forces_trial
from glotouch_bt.validation.forces.accepted import accepted_by
from glotouch_bt.validation.forces.campaign import ForceCampaign, run_campaign
from glotouch_bt.validation.forces.draw import FACTOR, MIN_S, draw_plan, draw_scene, is_index, is_number
from glotouch_bt.validation.forces.following import JOINTS, MOMENTS, RATES_RAD_S, matrix
from glotouch_bt.validation.forces.summary import summarise
from glotouch_bt.validation.forces.trial import described, offences

ALL = {
    name: {key: list(range(7)) for key, f in kind.effect.Params.model_fields.items() if is_index(f)}
    for name, kind in CATALOGUE.items()
}
DURATIONS_S = {"tool_pickup": 9.5, "tool_calibrate": 14.0, "touch*[1]": 0.0}
PLANS = {seed: draw_plan(seed, ALL, DURATIONS_S, 24.0) for seed in range(400)}


def test_a_plan_follows_from_its_seed_alone() -> None:
    again = {seed: draw_plan(seed, ALL, DURATIONS_S, 24.0) for seed in reversed(range(0, 400, 7))}
    assert again == {seed: PLANS[seed] for seed in again}
    assert len({described(p) for p in PLANS.values()}) == len(PLANS)
    assert [draw_scene(s, 8) for s in range(20)] == [draw_scene(s, 8) for s in range(40)][:20]
    assert set(Counter(draw_scene(s, 8) for s in range(400))) == set(range(8))


def test_every_drawn_plan_is_read_again_from_its_yaml() -> None:
    for plan in PLANS.values():
        again = check_plan(parse_yaml(plan.as_yaml(), "plan"))
        assert [(f.name, f.params, f.when, f.duration, f.repeat) for f in again.faults] == [
            (f.name, f.params, f.when, f.duration, f.repeat) for f in plan.faults
        ]


def test_two_or_three_different_faults_of_every_kind_and_start() -> None:
    assert {len(p.faults) for p in PLANS.values()} == {2, 3}
    assert all(len({f.name for f in p.faults}) == len(p.faults) for p in PLANS.values())
    faults = [f for p in PLANS.values() for f in p.faults]
    assert {f.name for f in faults} == set(CATALOGUE)
    starts = Counter("node" if f.when.node else "time" if f.when.time_s is not None else "first" for f in faults)
    assert min(starts.values()) > 0.25 * len(faults)
    assert {f.when.node for f in faults} == {None, *DURATIONS_S}
    for fault in faults:
        assert fault.when.time_s is None or fault.when.time_s <= 24.0
        assert fault.when.node is None or fault.when.after_s <= DURATIONS_S[fault.when.node]
        assert fault.duration.until == "ever" or (fault.duration.duration_s or 0.0) >= MIN_S


def test_parameters_stay_in_their_bounds_and_near_their_defaults() -> None:
    signs = set()
    for fault in (f for p in PLANS.values() for f in p.faults):
        for key, field in type(fault.params).model_fields.items():
            value = getattr(fault.params, key)
            if is_index(field):
                assert value in range(7)
            elif not is_number(field):
                assert value == field.default
            else:
                pairs = zip(value, field.default, strict=True) if isinstance(value, tuple) else [(value, field.default)]
                for drawn, default in pairs:
                    assert all(holds(drawn, limit) for _, limit, holds in limits_of(field)), (fault.name, key)
                    rounding = 0.5 if field.annotation is int else 0.01 * abs(default)
                    assert abs(drawn) <= FACTOR * abs(default) + rounding
                    signs.add((fault.name, drawn < 0.0 < default))
    assert ("wrench_bias", True) in signs
    assert ("hang", True) not in signs


def test_only_accepted_faults_and_indices_are_found() -> None:
    def accepts(plan: FaultPlan) -> bool:
        (fault,) = plan.faults
        return fault.kind.channel != "world" and getattr(fault.params, "joint", 0) < 6

    found = accepted_by(accepts)
    assert found.keys() == {n for n, k in CATALOGUE.items() if k.channel != "world"}
    assert found["following_error"] == {"joint": [0, 1, 2, 3, 4, 5]}
    assert "following_error" not in accepted_by(lambda plan: plan.faults[0].name != "following_error")


def test_the_matrix_of_following_errors_is_complete() -> None:
    cells = list(matrix(MOMENTS, JOINTS))
    assert len(cells) == 7 * 4 * 2 * 5 == len({c.name for c in cells})
    for cell in cells:
        check_plan(parse_yaml(cell.plan().as_yaml(), "plan"))
    assert {abs(c.rate_rad_s) for c in cells} == set(RATES_RAD_S)


def row(n: int, **other: Any) -> dict[str, Any]:
    """The row of a trial that might have been."""
    common = {"folder": f"s{n}", "mission": "m", "backend": "b", "seed": n, "wall_s": 2.0, "cause": ""}
    ended = {
        "status": "aborted",
        "effective": 2,
        "peak_force_N": 5.0 + n,
        "result_written": True,
        "faults": "a() x; b() y",
    }
    return common | ended | other


def test_the_summary_of_rows() -> None:
    rows = [
        row(0),
        row(1, peak_force_N=30.01),
        row(2, status="success", false_success=True, effective=1, without_effect=["b"]),
        row(3, status="lost", peak_force_N=None, result_written=False),
        row(4, effective=0, peak_force_N=29.0),
        row(5, status="refused", effective=0, peak_force_N=None, result_written=None, cause="no room"),
        row(6, peak_force_N=30.0),
        row(7, status="not started", effective=0, peak_force_N=None, result_written=None, cause="no robot"),
    ]
    found = summarise(rows)
    assert (found["trials"], found["several_effective"], found["without_effect"]) == (5, 4, ["s4"])
    assert [found[k]["rate"] for k in ("over_hard_limit", "false_success", "no_result")] == [0.2, 0.2, 0.2]
    assert found["refused"] == ["s5: no room"]
    assert found["not_started"] == ["s7: no robot"]
    assert found["true_peak_unknown"] == ["s3"]
    assert found["largest_peak_force_N"] == 30.01
    assert [p["folder"] for p in found["largest_peaks"]] == ["s1", "s6", "s4", "s2", "s0"]
    assert found["by_scene"]["m on b"]["trials"] == 5
    assert (found["by_fault"]["a"]["trials"], found["by_fault"]["b"]["trials"]) == (5, 4)
    assert [offences(r) for r in rows] == [
        [],
        ["over the hard limit"],
        ["false success"],
        ["no result"],
        [],
        [],
        [],
        [],
    ]


RESULT: dict[str, Any] = {
    "mission": "m", "seed": 0, "status": "success", "reason_chain": [], "peak_force_N": 5.0, "sensed_peak_force_N": 4.0,
    "retrieved": "block", "correct": None, "sim_time_s": 1.0, "faults": [{"name": "a", "effective": True}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "lifts", "false"),
    [
        ({}, True, False),
        ({"retrieved": None}, True, True),
        ({"retrieved": None}, False, False),
        ({"correct": False}, True, True),
        ({"correct": False, "status": "failure"}, True, False),
        ({"retrieved": None, "unscored": "the simulation is dead"}, True, False),
    ],
)
def test_a_success_without_the_object_is_false(change: dict[str, Any], lifts: bool, false: bool) -> None:
    found = forces_trial.row_of(RESULT | change, lifts)
    assert found["false_success"] is false
    assert found["peak_force_N"] == (None if "unscored" in change else 5.0)


class Here:
    """An executor that is this process."""

    def submit(self, call: Any, trial: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if trial.identity["seed"] == 3 and trial.identity["faults"] is not None:
            future.set_exception(WorkerLost(-9))
        else:
            future.set_result(call(trial))
        return future


def test_an_offending_trial_keeps_its_plan_and_the_command_that_repeats_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def launched(request: Any) -> Any:
        request.out.mkdir(parents=True, exist_ok=True)
        (request.out / "run.mcap").write_bytes(b"")
        result = RESULT | {"peak_force_N": 40.0 if request.seed == 2 else 5.0}
        (request.out / "result.json").write_text(json.dumps(result))
        return type("Done", (), {"result": result})

    def twin(request: Any, labels: Any) -> Any:
        undisturbed = {"status": "success", "peak_force_N": 5.0, "wall_s": 1.0, "sim_s": 20.0, "lifted": True}
        return dict(labels) | undisturbed | {"accepted": ALL, "durations_s": DURATIONS_S}

    monkeypatch.setattr(forces_trial, "launch_trial", launched)
    monkeypatch.setattr(forces_campaign, "run_twin", twin)
    scene = Campaign(mission="pick_at", seeds=range(1, 5), out=tmp_path, backend="fake", settings={"x": "5"})
    told: list[tuple[int, int]] = []
    summary = run_campaign(ForceCampaign((scene,)), Here(), lambda r, n, total: told.append((n, total)))  # type: ignore[arg-type]
    assert told[-1] == (5, 5)
    assert summary["over_hard_limit"]["rate"] == summary["no_result"]["rate"] == 0.25
    over, lost = summary["offending"]
    assert (over["folder"], over["offences"], lost["status"]) == ("s2", ["over the hard limit"], "lost")
    assert (tmp_path / "s2" / "plan.yaml").read_text() == over["plan"] == draw_plan(2, ALL, DURATIONS_S, 20.0).as_yaml()
    assert (
        f"glotouch run pick_at --backend fake --seed 2 --set x=5 --conditions nominal --faults {tmp_path}"
        in over["command"]
    )
    assert (tmp_path / "s2" / "run.mcap").exists()
    assert not (tmp_path / "s1" / "run.mcap").exists()
    assert json.loads((tmp_path / "summary.json").read_text()) == summary


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--mission", "calibrat"], "did you mean 'calibrate'"),
        (["--mission", "calibrate", "--mission", "calibrate"], "given twice"),
        (["--backend", "mujco"], "unknown backend 'mujco'"),
        (["--backend", "mujoco", "--backend", "mujoco:fixed=true"], "given twice"),
        (["--backend", "flexiv_xense:devices"], "must be NAME=VALUE"),
        (["--conditions", "nominl"], "did you mean 'nominal'"),
        (["--moment", "draw"], "only with --following"),
        (["--following", "--moment", "drew"], "did you mean 'draw'"),
        (["--following", "--joint", "7"], "unknown joint '7'"),
        (["--following", "--mission", "retrieve"], "are fixed"),
        (["--trials", "0"], "--trials"),
    ],
)
def test_bad_input_is_one_message(words: list[str], message: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["bench", "forces", *words, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output
    assert not (tmp_path / "out").exists()
