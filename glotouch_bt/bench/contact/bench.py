"""`bench contact`: trace a calibration square with the probe and the bare gripper (paper, contact-mode validation).

Both modes run the mission's own sweep and trace. Errors are computed in the base frame B: estimates in K are
transformed with the registration given to the robot, so registration errors do not count. The first table has the
square bolted to the floor, the second has it free.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.bench.contact.plots import plot_errors, plot_traces
from glotouch_bt.bench.contact.square import TOOLS, Tool, TracedSquare, traced_square, true_square
from glotouch_bt.bench.retrieve import cause
from glotouch_bt.bench.statistics import bootstrap_mean, wilson
from glotouch_bt.campaign import (
    Campaign,
    OnRow,
    Row,
    Trial,
    crashed,
    launch_trial,
    run_trials,
    silent,
    write_summary,
    write_table,
)
from glotouch_bt.perception.touch import polygon_distance
from glotouch_bt.report import RunRecord, read_run
from glotouch_bt.robot import Array, Pose
from glotouch_bt.runs import RunRequest

METRICS = ("centre_error_mm", "contact_std_mm", "contact_rms_mm", "max_contact_mm", "side_error_mm")
PAPER = {
    "probe": dict(zip(METRICS, (0.37, 0.84, 0.87, 1.58, 0.95), strict=True)),
    "gripper": dict(zip(METRICS, (3.15, 4.81, 5.08, 6.93, 5.67), strict=True)),
}
MORE = (
    "yaw_error_deg", "displacement_mm", "turned_deg", "ball_rms_mm", "tip_before_mm", "tip_after_mm",
    "compliance_x_mm_N", "compliance_y_mm_N", "calibration_s",
)  # fmt: skip
COLUMNS = (
    "tool", "square", "seed", "exit_code", "status", "cause", "contacts", *METRICS, *MORE, "latency_ms",
    "peak_force_N", "sim_time_s", "wall_time_s", "folder",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ContactCampaign(Campaign):
    """Settings of the campaign; the tool's name completes the mission's, and the backend knows the option `fixed`.

    The `settings` are those of the probe's mission.

    Attributes:
        per_side: Contacts made for each side of the square.
    """

    mission: str = "contact"
    per_side: int

    def trials(self) -> list[Trial]:
        """Return every trial, seeds outermost, with the square bolted down and free."""
        return [self._trial(seed, t, fixed) for seed in self.seeds for fixed in (True, False) for t in TOOLS]

    def _trial(self, seed: int, tool: Tool, fixed: bool) -> Trial:
        own = self.settings if tool == "probe" else {}
        settings = {**own, "contacts": str(4 * self.per_side), "fixed": str(fixed).lower()}
        square = "fixed" if fixed else "free"
        name = f"{tool}-{square}-s{seed}"
        request = replace(self.request(seed, name, settings=settings), mission=f"{self.mission}_{tool}")
        head = {"tool": tool, "square": square, "seed": seed, "folder": name}
        return Trial.of(request, partial(run_trial, head, request), partial(_failed, head))


def run_trial(head: Row, request: RunRequest) -> Row:
    """Run one trial in this process and return its row, which begins with the columns `head`."""
    done = launch_trial(request)
    row = head | {k: done.result.get(k) for k in COLUMNS if k in done.result}
    row |= {"exit_code": done.exit_code, "cause": ""}
    if done.exit_code != 0:
        return row | {"cause": cause(done.result)}
    objects = len(done.result["candidates"])
    if objects != 1:
        return row | {"cause": f"the square was traced as {objects} objects"}
    record = read_run(done.folder)
    return row | score(record, traced_square(record, head["tool"], head["square"] == "fixed"))


def _failed(head: Row, error: Exception) -> Row:
    return head | crashed(error)


def score(record: RunRecord, traced: TracedSquare) -> dict[str, Any]:
    """Return the paper's five errors and ours, in mm and degrees."""
    before, true = (true_square(record, traced.height_B_m, when) for when in ("start", "end"))
    contact = polygon_distance(true.corners_B_m, traced.points_B_m)
    ball = polygon_distance(true.corners_B_m, traced.tips_B_m) - traced.tip_radius_m
    calibration = record.of_kind("calibration")
    row: dict[str, Any] = {
        "contacts": len(contact),
        "centre_error_mm": 1e3 * float(np.linalg.norm(traced.centre_B_m - true.centre_B_m)),
        "contact_std_mm": 1e3 * float(np.std(contact)),
        "contact_rms_mm": 1e3 * float(np.sqrt(np.mean(contact**2))),
        "max_contact_mm": 1e3 * float(np.abs(contact).max()),
        "side_error_mm": 1e3 * float(np.mean(np.abs(traced.side_m - np.sort(true.sides_m)[::-1]))),
        "yaw_error_deg": abs(_quarter_deg(traced.yaw_rad - true.yaw_rad)),
        "displacement_mm": 1e3 * float(np.linalg.norm(true.centre_B_m - before.centre_B_m)),
        "turned_deg": abs(_quarter_deg(true.yaw_rad - before.yaw_rad)),
    }
    if calibration:
        tip = np.array(calibration[-1].data["tip_P_m"])
        really = true_tip_P_m(record)
        nominal = np.array([0.0, 0.0, tip[2]])
        row["ball_rms_mm"] = 1e3 * float(np.sqrt(np.mean(ball**2)))
        row["tip_before_mm"] = 1e3 * float(np.linalg.norm((nominal - really)[:2]))
        row["tip_after_mm"] = 1e3 * float(np.linalg.norm((tip - really)[:2]))
        row["latency_ms"] = 1e3 * float(calibration[-1].data["latency_s"])
        begun = [t.stamp_s for t in record.ticks if t.node.endswith("tool_calibrate") and t.new == "RUNNING"]
        row["calibration_s"] = calibration[-1].stamp_s - begun[-1]
        measured = calibration[-1].data["compliance_P_m_N"]
        if measured is not None:
            row["compliance_x_mm_N"], row["compliance_y_mm_N"] = (1e3 * float(c) for c in measured)
    return row


def true_tip_P_m(record: RunRecord) -> Array:
    """Return the true position (3,) of the ball in P at the end of the run."""
    hand = Pose(record.samples["position_B_P"][-1], record.samples["quat_B_P"][-1])
    return hand.inverse().apply(np.array(record.truth["tip_B_m"], dtype=np.float64))


def run_campaign(campaign: ContactCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every trial on the executor, write trials.csv, summary.json and two plots and return the summary."""
    rows = run_trials(executor, campaign.trials(), campaign, on_row, write=partial(_write, campaign.out))
    rows.sort(key=_order)
    more = {
        "paper": PAPER,
        "contacts_per_side": campaign.per_side,
        "settings": dict(campaign.settings),
        "backend": campaign.backend,
    }
    summary = summarise(rows) | campaign.described() | more
    summary = write_summary(campaign.out, summary)
    plot_errors(rows, PAPER, campaign.out / "errors.png")
    plot_traces(rows, campaign.out)
    return summary


def _order(row: Mapping[str, Any]) -> tuple[str, str, int]:
    return row["square"], row["tool"], row["seed"]


def _write(folder: Path, rows: Sequence[Row]) -> None:
    write_table(folder, "trials.csv", COLUMNS, sorted(rows, key=_order))


def summarise(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return means with bootstrap intervals over the traced trials of each tool, and the rate of traced trials."""

    def of(square: str, tool: Tool) -> dict[str, Any]:
        group = [r for r in rows if r["square"] == square and r["tool"] == tool]
        good = [r for r in group if not r["cause"]]
        found: dict[str, Any] = {"traced": wilson(len(good), len(group))}
        for name in (*METRICS, *MORE, "peak_force_N", "sim_time_s"):
            values = [r[name] for r in good if r.get(name) is not None]
            if values:
                found[name] = bootstrap_mean(values)
        return found

    causes = sorted({f"{r['square']} {r['tool']} seed {r['seed']}: {r['cause']}" for r in rows if r["cause"]})
    return {
        **{tool: of("fixed", tool) for tool in TOOLS},
        "free": {tool: of("free", tool) for tool in TOOLS},
        "not_traced": causes,
    }


def _quarter_deg(angle_rad: float) -> float:
    """Return an angle modulo the square's symmetry, in -45..45 degrees."""
    return float(np.degrees((angle_rad + np.pi / 4) % (np.pi / 2) - np.pi / 4))
