"""Measure the duration of one cycle through a backend, from the setpoint to the new state."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from glotouch_bt.campaign import write_summary
from glotouch_bt.lazy import load_all
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.motion import Kinematics
from glotouch_bt.robot import Array, Command, JointSetpoint, load_backend

SWAY_RAD = 0.004
"""Amplitude of the first joint's sway while measuring, so that every setpoint is new."""
SWAY_S = 4.0
"""Period of the sway."""


@runtime_checkable
class LatencyReporting(Protocol):
    """A robot that measures the latency of its last cycle.

    Attributes:
        latency_s: Time from the call to the setpoint at the device, plus time from the newest sample to the
            observation, without the wait for the end of the period.
        late_periods: Control periods that passed without a command.
    """

    latency_s: float
    late_periods: int


@dataclass(frozen=True)
class LinkStudy:
    """A measurement to be done.

    Attributes:
        backend: Registered name.
        options: Backend options.
        duration_s: Duration on the robot clock.
        mission: Mission whose world is opened.
        out: Folder for summary.json.
    """

    backend: str
    out: Path
    options: Mapping[str, str] = field(default_factory=dict)
    duration_s: float = 60.0
    mission: str = "retrieve"


def sway(q0: Array, period_s: float, k: int, kinematics: Kinematics) -> JointSetpoint:
    """Return the k-th setpoint of a slow sway of the first joint, from rest at q0 (dof,) rad."""
    w, t = 2.0 * np.pi / SWAY_S, (k + 1) * period_s
    unit = np.eye(len(q0))[0]
    q = q0 + SWAY_RAD * (1.0 - np.cos(w * t)) * unit
    dq, ddq = SWAY_RAD * w * np.sin(w * t) * unit, SWAY_RAD * w**2 * np.cos(w * t) * unit
    return JointSetpoint(q, dq, ddq, kinematics.fk(q))


def percentiles_ms(times_s: Array) -> dict[str, float]:
    """Return p50, p99, p99.9 and the maximum of durations (n,), in ms."""
    values = np.percentile(1e3 * times_s, [50.0, 99.0, 99.9, 100.0])
    return {name: round(float(v), 4) for name, v in zip(("p50", "p99", "p99.9", "max"), values, strict=True)}


def run_study(study: LinkStudy, on_progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Cycle for the whole duration; write and return the summary.

    Raises:
        BackendError: The backend did not open or broke down.
    """
    world = load_mission(study.mission, {}).world
    backend = load_backend(study.backend)
    load_all()  # a driver stops the arm when the client is silent for as long as an import takes
    walls, latencies, blocks = [], [], []
    with backend.open(world, load_conditions("nominal"), 0, study.options) as robot:
        kinematics = Kinematics(robot.description)
        period_s, q0 = robot.period_s, robot.observe().q[-1].copy()
        n = round(study.duration_s / period_s)
        for k in range(n):
            command = Command(sway(q0, period_s, k, kinematics))
            began = time.perf_counter()
            observation = robot.cycle(command)
            walls.append(time.perf_counter() - began)
            blocks.append(len(observation.stamp_s))
            if isinstance(robot, LatencyReporting):
                latencies.append(robot.latency_s)
            if on_progress is not None and k % 100 == 0:
                on_progress(k * period_s)
        late = robot.late_periods if isinstance(robot, LatencyReporting) else None
    summary: dict[str, Any] = {
        "backend": study.backend,
        "options": dict(study.options),
        "cycles": n,
        "cycle_ms": percentiles_ms(np.array(walls)),
        "latency_ms": percentiles_ms(np.array(latencies)) if latencies else None,
        "late_periods": late,
        "samples_per_cycle": {"min": min(blocks), "median": float(np.median(blocks)), "max": max(blocks)},
    }
    return write_summary(study.out, summary)
