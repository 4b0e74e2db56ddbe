"""`bench speed`: wall time of a mission against that of its bare physics steps.

Each mission runs as with `glotouch run` (same tree, record and report). Its solver steps are then repeated alone. Both
must end in the same state, bit for bit, so the denominator of `over_physics` is exactly the same physics.

Times are wall times of this process (`time.perf_counter`), missions one after the other. Run it alone on a core. The
factors by processor time (`time.process_time`) are given too: where they differ, the core was shared.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from glotouch_bt.campaign import Campaign, OnRow, silent, write_summary, write_table
from glotouch_bt.lazy import load_all
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.execution import run_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import Record, Recorder
from glotouch_bt.report import write_report
from glotouch_bt.robot import BadInput, Command, Observation, Request, Robot, Ticket, load_backend
from glotouch_bt.runs import RunFolder

COLUMNS = (
    "seed", "status", "sim_s", "wall_s", "bare_s", "steps", "same_end_state", "realtime_factor", "bare_factor",
    "over_physics", "cpu_s", "bare_cpu_s", "robot_s", "tree_s", "record_s", "open_s", "report_s",
)  # fmt: skip
TARGET_REALTIME = 15.0
"""Required ratio of simulated time to wall time. Source: the project's speed requirement."""
TARGET_OVER_PHYSICS = 2.0
"""Largest ratio of wall time to bare step time. Source: the project's speed requirement."""


@dataclass
class CycleTimes:
    """Durations of the parts of each control cycle, s; one entry a cycle.

    Attributes:
        robot: Inside `Robot.cycle`: physics, sensors, gripper.
        tree: Between two cycles, without the record: the tick with skills, motion, touch and matching.
        record: Inside the record.
        whole: From one command to the next.
        leaf: Tree time by leaf: up to an event the leaf that wrote it, then the leaf running after the tick.
    """

    robot: list[float] = field(default_factory=list)
    tree: list[float] = field(default_factory=list)
    record: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    leaf: dict[str, float] = field(default_factory=dict)


class TimedRobot(Robot):
    """Wrapper that times a robot.

    Args:
        robot: The robot.
        times: Filled, together with the `TimedRecord` of the same run.
    """

    def __init__(self, robot: Robot, times: CycleTimes) -> None:
        self._robot, self._times = robot, times
        self.description, self.limits, self.period_s = robot.description, robot.limits, robot.period_s
        self._left = 0.0
        self._booked = 0.0
        self.writing = 0.0
        self.running = ""

    def observe(self) -> Observation:
        """See `Robot`; the first tick is timed from here."""
        self._left = time.perf_counter()
        return self._robot.observe()

    def cycle(self, command: Command) -> Observation:
        """See `Robot`."""
        entered = time.perf_counter()
        self.account(entered)
        try:
            return self._robot.cycle(command)
        finally:
            self._left = time.perf_counter()
            self._times.robot.append(self._left - entered)

    def account(self, now: float) -> None:
        """Assign the time since the last cycle to tree and record."""
        c = self._times
        outside = now - self._left
        tree = outside - self.writing
        c.tree.append(tree)
        c.record.append(self.writing)
        c.whole.append(outside + (c.robot[-1] if c.robot else 0.0))
        self.book(self.running, now)
        self.writing = self._booked = 0.0

    def book(self, leaf: str, now: float) -> None:
        """Assign the unassigned tree time of this tick to a leaf."""
        spent = now - self._left - self.writing
        self._times.leaf[leaf] = self._times.leaf.get(leaf, 0.0) + spent - self._booked
        self._booked = spent

    def start(self, request: Request) -> Ticket:
        """See `Robot`."""
        return self._robot.start(request)

    def hold(self) -> None:
        """See `Robot`."""
        self._robot.hold()

    def close(self) -> None:
        """See `Robot`."""
        self._robot.close()


class TimedRecord:
    """Wrapper that times a record and tells the timed robot which leaf runs."""

    def __init__(self, record: Record, robot: TimedRobot) -> None:
        self._record, self._robot = record, robot
        self._parents: set[str] = set()

    def block(self, observation: Observation, command: Command) -> None:
        """See `Record`."""
        began = time.perf_counter()
        self._record.block(observation, command)
        self._robot.writing += time.perf_counter() - began

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """See `Record`."""
        began = time.perf_counter()
        self._record.tick(stamp_s, changes)
        self._parents.update(node.rpartition("/")[0] for node, _, _ in changes)
        for node, _, new in changes:
            if node not in self._parents and str(getattr(new, "value", new)) != "INVALID":
                self._robot.running = node.rpartition("/")[2]
        self._robot.writing += time.perf_counter() - began

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """See `Record`."""
        began = time.perf_counter()
        self._robot.book(str(data.get("node", self._robot.running)), began)
        self._record.event(kind, stamp_s, data)
        self._robot.writing += time.perf_counter() - began

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """See `Record`."""
        began = time.perf_counter()
        self._record.port(stamp_s, key, value)
        self._robot.writing += time.perf_counter() - began


@dataclass(frozen=True)
class SpeedTrial:
    """One measured mission: its row and its cycle times."""

    row: Mapping[str, Any]
    times: CycleTimes


def run_trial(study: Campaign, seed: int) -> SpeedTrial:
    """Run one mission and replay its steps.

    Raises:
        BadInput: The backend cannot repeat its steps, or the mission cannot be run.
    """
    folder = RunFolder(study.out / f"s{seed}")
    opening = time.perf_counter()
    mission = load_mission(study.mission, study.settings, objects=study.objects)
    conditions = load_conditions(study.conditions)
    backend = load_backend(study.backend)
    load_all()  # as a run does before it starts
    described: dict[str, object] = {
        "mission": study.mission, "backend": study.backend, "seed": seed, "conditions": study.conditions,
        "container": mission.world.container, "parameters": dict(study.settings),
    }  # fmt: skip
    times = CycleTimes()
    with backend.open(mission.world, conditions, seed, {"trace": True}) as robot:
        referee = backend.referee(robot)
        if referee is None:
            raise BadInput(f"backend {study.backend!r} cannot repeat its steps; bench speed needs a simulation")
        timed = TimedRobot(robot, times)
        began, cpu = time.perf_counter(), time.process_time()
        with Recorder(folder.path / "run.mcap", described) as recorder:
            outcome = run_mission(mission, timed, TimedRecord(recorder, timed))
            if isinstance(outcome.error, KeyboardInterrupt):
                raise outcome.error
            timed.account(time.perf_counter())
            ticked = time.perf_counter()
        ended, cpu_s = time.perf_counter(), time.process_time() - cpu
        folder.write_json("result.json", {"mission": mission.name, "seed": seed, "status": outcome.status})
        reporting = time.perf_counter()
        write_report(folder.path)
        report_s = time.perf_counter() - reporting
        bare = referee.replay_bare_steps()
    if bare is None:
        raise BadInput(f"backend {study.backend!r} kept no trace of its steps")
    wall_s, sim_s = ended - began, outcome.end_s - outcome.start_s
    row = {
        "seed": seed, "status": outcome.status, "sim_s": sim_s, "wall_s": wall_s, "bare_s": bare.wall_s,
        "steps": bare.steps, "same_end_state": bare.same_end_state, "realtime_factor": sim_s / wall_s,
        "bare_factor": sim_s / bare.wall_s, "over_physics": wall_s / bare.wall_s, "cpu_s": cpu_s,
        "bare_cpu_s": bare.cpu_s,
        "robot_s": sum(times.robot), "tree_s": sum(times.tree),
        "record_s": sum(times.record) + ended - ticked, "open_s": began - opening, "report_s": report_s,
    }  # fmt: skip
    return SpeedTrial(row, times)


def run_study(study: Campaign, on_row: OnRow = silent) -> dict[str, Any]:
    """Run one mission a seed in turn, write trials.csv and summary.json, and return the summary.

    The backend must know the option `trace` and have a referee.
    """
    trials = []
    for seed in study.seeds:
        trials.append(run_trial(study, seed))
        on_row(trials[-1].row, len(trials), len(study.seeds))
    rows = ({k: round(v, 6) if isinstance(v, float) else v for k, v in t.row.items()} for t in trials)
    write_table(study.out, "trials.csv", COLUMNS, rows)
    summary = summarise(trials) | study.described() | {"settings": dict(study.settings), "backend": study.backend}
    return write_summary(study.out, summary)


def spread(values: Sequence[float]) -> dict[str, float]:
    """Return median, minimum and maximum."""
    x = np.asarray(values, dtype=np.float64)
    return {"median": float(np.median(x)), "min": float(x.min()), "max": float(x.max()), "n": len(x)}


def quantiles_us(times_s: Sequence[float]) -> dict[str, float]:
    """Return p50, p99 and maximum of durations, in microseconds."""
    x = 1e6 * np.asarray(times_s, dtype=np.float64)
    if x.size == 0:
        return {"p50": 0.0, "p99": 0.0, "max": 0.0}
    p50, p99 = np.percentile(x, [50.0, 99.0])
    return {"p50": round(float(p50), 1), "p99": round(float(p99), 1), "max": round(float(x.max()), 1)}


def summarise(trials: Sequence[SpeedTrial]) -> dict[str, Any]:
    """Return factors (median and range over trials), cycle times over all cycles, and a breakdown of the time.

    Keys: realtime_factor, bare_factor (of the bare steps), over_physics; mission_wall_s, wall time of one mission;
    control_cycle_us (command to command), robot_cycle_us, tick_us, record_us; breakdown_s, mean seconds a mission:
    `physics` (bare steps), `robot` (rest of Robot.cycle), `tree`, `record`, `rest`; `open` and `report` are not part of
    the wall time; by_cpu, factors by processor time; leaves_s (tree time by leaf); same_end_state; targets and whether
    they are met.
    """
    rows = [t.row for t in trials]

    def mean(key: str) -> float:
        return float(np.mean([r[key] for r in rows]))

    def cycles(part: str) -> dict[str, float]:
        return quantiles_us([v for t in trials for v in getattr(t.times, part)])

    realtime = spread([r["realtime_factor"] for r in rows])
    over = spread([r["over_physics"] for r in rows])
    leaves: dict[str, float] = {}
    for t in trials:
        for name, seconds in t.times.leaf.items():
            leaves[name or "start"] = leaves.get(name or "start", 0.0) + seconds / len(trials)
    parts = {
        "physics": mean("bare_s"),
        "robot": mean("robot_s") - mean("bare_s"),
        "tree": mean("tree_s"),
        "record": mean("record_s"),
        "rest": mean("wall_s") - mean("robot_s") - mean("tree_s") - mean("record_s"),
    }
    return {
        "realtime_factor": realtime,
        "bare_factor": spread([r["bare_factor"] for r in rows]),
        "over_physics": over,
        "mission_wall_s": spread([r["wall_s"] for r in rows]),
        "by_cpu": {
            "realtime_factor": spread([r["sim_s"] / r["cpu_s"] for r in rows]),
            "over_physics": spread([r["cpu_s"] / r["bare_cpu_s"] for r in rows]),
        },
        "control_cycle_us": cycles("whole"),
        "robot_cycle_us": cycles("robot"),
        "tick_us": cycles("tree"),
        "record_us": cycles("record"),
        "breakdown_s": parts,
        "leaves_s": dict(sorted(leaves.items(), key=lambda item: -item[1])),
        "sim_s": mean("sim_s"),
        "wall_s": mean("wall_s"),
        "cpu_s": mean("cpu_s"),
        "open_s": mean("open_s"),
        "report_s": mean("report_s"),
        "same_end_state": all(r["same_end_state"] for r in rows),
        "succeeded": sum(r["status"] == "success" for r in rows),
        "targets": {
            "realtime_factor": {"least": TARGET_REALTIME, "met": realtime["median"] >= TARGET_REALTIME},
            "over_physics": {"most": TARGET_OVER_PHYSICS, "met": over["median"] <= TARGET_OVER_PHYSICS},
        },
    }
