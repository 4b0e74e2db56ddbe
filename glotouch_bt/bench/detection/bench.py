"""Run `bench detection` and write its summary, table and plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from glotouch_bt.bench.detection.curve import Push, false_alarms, found_share, per_hour
from glotouch_bt.bench.detection.plot import plot_curves
from glotouch_bt.bench.detection.signals import Hand, MoveKind
from glotouch_bt.bench.detection.simulated import WORLD, FreeMotion, SimulatedProbe, free_motion, push_once
from glotouch_bt.bench.statistics import wilson
from glotouch_bt.campaign import write_summary, write_table
from glotouch_bt.mission.read import load_conditions, load_world
from glotouch_bt.perception.touch import GuardParams, Payload
from glotouch_bt.robot import RobotDescription

PUSH_N = 0.6
FORCES_N = (0.10, 0.12, 0.14, 0.16, 0.18, 0.20, 0.25, 0.30, 0.40, 0.60)
GROWS_S = (0.001, 0.3)
COLUMNS = ("part", "conditions", "seed", "kind", "push", "force_N", "count", "n", "hours")


@dataclass(frozen=True)
class DetectionStudy:
    """Settings of the study.

    Attributes:
        conditions: Paths or shipped names.
        seeds: Seeds of the synthetic pushes (one push each), of the synthetic hours, and of the simulated robots.
        hours: Hours of synthetic signal for each kind of move.
        minutes: Minutes of simulated guarded free motion, over all robots.
        pushes: Number of simulated pushes of 0.6 N, over all robots.
        robots: Number of simulated robots; they use the first seeds.
        backend: Registered name.
        out: Folder for summary.json, trials.csv and detection.png.
    """

    conditions: tuple[str, ...]
    seeds: tuple[int, ...]
    hours: float
    minutes: float
    pushes: int
    robots: int
    backend: str
    out: Path


def run_study(study: DetectionStudy, on_line: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Run everything, write the folder and return the summary: `synthetic` and `simulated` results by condition."""
    rows: list[dict[str, Any]] = []
    summary: dict[str, Any] = {"guard": asdict(GuardParams()), "seeds": list(study.seeds), "conditions": {}}
    for name in study.conditions:
        simulated, description = _simulated(study, name, rows, on_line)
        synthetic = _synthetic(study, name, description, rows, on_line)
        summary["conditions"][name] = {"simulated": simulated, "synthetic": synthetic}
    write_table(study.out, "trials.csv", COLUMNS, rows)
    summary = write_summary(study.out, summary)
    plot_curves(summary, study.out / "detection.png")
    return summary


def _simulated(
    study: DetectionStudy, name: str, rows: list[dict[str, Any]], on_line: Callable[[str], None]
) -> tuple[dict[str, Any], RobotDescription]:
    """Measure free motion and pushes with the prober on simulated robots; also return the robot's description."""
    free: list[FreeMotion] = []
    found = early = pushed = 0
    late: list[float] = []
    seeds = study.seeds[: study.robots]
    for seed in seeds:
        rig = SimulatedProbe(name, seed, study.backend)
        with rig.robot:
            free.append(free_motion(rig, 60.0 * study.minutes / len(seeds)))
            rows.append(_row("free", name, seed=seed, count=free[-1].false_contacts, hours=free[-1].guarded_s / 3600.0))
            on_line(f"{name} seed {seed}: {free[-1].false_contacts} false in {free[-1].guarded_s / 60:.1f} min")
            for k in range(-(-study.pushes // len(seeds))):
                kind, grows_s = ("across", "down")[k % 2], GROWS_S[k // 2 % 2]
                trial = push_once(rig, PUSH_N, kind, grows_s)
                pushed, found, early = pushed + 1, found + trial.found, early + trial.early
                if trial.found and grows_s == GROWS_S[0]:
                    late.append(trial.late_s)
                rows.append(
                    _row("pushed", name, seed=seed, kind=kind, push=grows_s, force_N=PUSH_N, count=trial.found, n=1)
                )
            on_line(f"{name} seed {seed}: {found} of {pushed} pushes found")
    return {
        "false_contacts_per_hour": per_hour(
            sum(f.false_contacts for f in free), sum(f.guarded_s for f in free) / 3600.0
        ),
        "moves": sum(f.moves for f in free),
        "sim_minutes": sum(f.total_s for f in free) / 60.0,
        "found_0.6N": wilson(found, pushed),
        "alarms_before_a_push": early,
        "sudden_push_dated_late_ms": {"mean": 1e3 * float(np.mean(late)), "sd": 1e3 * float(np.std(late))}
        if late
        else None,
    }, rig.robot.description


def _synthetic(
    study: DetectionStudy,
    name: str,
    description: RobotDescription,
    rows: list[dict[str, Any]],
    on_line: Callable[[str], None],
) -> dict[str, Any]:
    """Measure false alarms with and without inertia compensation, and the share of pushes detected against force."""
    conditions, probe, gripper = load_conditions(name), load_world(WORLD).probe, description.gripper
    tip_P = np.array([0.0, 0.0, probe.grasp_to_tip_m])
    hand = Hand(Payload.hand(gripper, probe), tip_P, gripper.pose_E_P)
    result: dict[str, Any] = {}
    for key, compensate, hours in (("false_alarms", True, study.hours), ("uncompensated", False, 0.1 * study.hours)):
        result[key] = false_alarms(hand, conditions, study.seeds, hours=hours, compensate=compensate)
        for kind, r in result[key].items():
            rows.append(_row(key, name, kind=kind, count=r["count"], hours=r["hours"]))
            on_line(f"{name} {key} {kind}: {r['count']} in {r['hours']:.2f} h")
    result["found"] = {}
    for kind in get_args(MoveKind):
        for push in get_args(Push):
            shares = [found_share(hand, conditions, kind, push, f, study.seeds) for f in FORCES_N]
            for force, share in zip(FORCES_N, shares, strict=True):
                n = share["n"]
                rows.append(
                    _row("found", name, kind=kind, push=push, force_N=force, count=round(share["rate"] * n), n=n)
                )
            result["found"][f"{kind} {push}"] = {str(f): s for f, s in zip(FORCES_N, shares, strict=True)}
    result["smallest_N"] = {k: _smallest(v) for k, v in result["found"].items()}
    return result


def _smallest(found: Mapping[str, Any]) -> float | None:
    """Return the smallest force above which at least 99 % of pushes are detected."""
    good: float | None = None
    for force in sorted(found, key=float, reverse=True):
        if found[force]["rate"] < 0.99:
            break
        good = float(force)
    return good


def _row(part: str, conditions: str, **values: Any) -> dict[str, Any]:
    return {"part": part, "conditions": conditions} | values


def table(summary: Mapping[str, Any]) -> Sequence[str]:
    """Format the summary as lines for a terminal."""
    lines = []
    for name, both in summary["conditions"].items():
        s, t = both["simulated"], both["synthetic"]
        f, p = s["false_contacts_per_hour"], s["found_0.6N"]
        lines += [
            f"{name}",
            f"  simulated: {f['count']} false contacts in {60 * f['hours']:.1f} min under guard, {s['moves']} moves "
            f"(95 %: at most {f['hi']:.2f} an hour)",
            f"  simulated: a push of 0.6 N detected in {p['rate']:.1%} of {p['n']} (95 %: at least {p['lo']:.1%})",
        ]
        for kind, r in t["false_alarms"].items():
            raw = t["uncompensated"][kind]
            lines.append(
                f"  synthetic {kind}: {r['count']} false in {r['hours']:.1f} h (95 %: {r['lo']:.2f}-{r['hi']:.2f} "
                f"an hour); without inertia compensation: {raw['rate']:.0f} an hour"
            )
        smallest = ", ".join(f"{k} {v if v is not None else 'none'} N" for k, v in t["smallest_N"].items())
        lines.append(f"  detected from: {smallest}")
    return lines
