"""The speed study against a backend whose every duration is known, and its arithmetic by hand."""

from __future__ import annotations

import csv
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from glotouch_bt.bench import speed
from glotouch_bt.bench.speed import CycleTimes, SpeedTrial, TimedRecord, TimedRobot
from glotouch_bt.campaign import Campaign
from glotouch_bt.robot import Backend, BadInput, Command, Observation, Robot
from glotouch_bt.robot.simulation.referee import BareSteps, Referee
from tests.support import fake_cli

MISSION = (
    "mission: nap\nworld: container_five\ntree:\n  - wait: {name: first, seconds: 0.2}\n  - wait: {name: second}\n"
)


@dataclass
class Clock:
    """Stands for `time.perf_counter`: it goes only when something says that it took time."""

    now: float = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(time, "perf_counter", clock)
    return clock


@pytest.fixture
def house(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    fake_cli.install_fakes(monkeypatch.setattr)
    return fake_cli


def furnish(house: ModuleType, clock: Clock, patch: pytest.MonkeyPatch, bare: BareSteps | None) -> None:
    """Make the study open a robot whose cycle takes 2 ms, with a referee that answers `bare`."""

    class Slow(house.NullRobot):  # type: ignore[name-defined,misc]
        def cycle(self, command: object) -> Observation:
            clock.now += 0.002
            observation: Observation = super().cycle(command)
            return observation

    class Judge:
        def replay_bare_steps(self) -> BareSteps | None:
            return bare

    class Traced(house.NullBackend):  # type: ignore[name-defined,misc]
        def open(self, world: Any, conditions: Any, seed: int, options: Mapping[str, object]) -> Robot:
            assert options == {"trace": True}
            return Slow(seed)

        def referee(self, robot: Robot) -> Referee | None:
            return Judge()  # type: ignore[return-value]

    patch.setattr(speed, "load_backend", lambda name: Traced())


def study(tmp_path: Path, **other: Any) -> Campaign:
    path = tmp_path / "nap.yaml"
    path.write_text(MISSION)
    given: dict[str, Any] = {
        "mission": str(path), "settings": {}, "seeds": (3, 4), "conditions": "nominal", "objects": None,
        "backend": "null", "out": tmp_path / "out",
    }  # fmt: skip
    return Campaign(**{**given, **other})


def test_a_study_of_known_durations(
    house: ModuleType, clock: Clock, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """30 cycles of 2 ms for 0.3 s of robot time: 5x real time; twice as long as 300 bare steps of 0.1 ms."""
    furnish(house, clock, monkeypatch, BareSteps(300, 0.030, 0.030, True))
    seen = []
    found = speed.run_study(study(tmp_path), lambda row, done, total: seen.append((row["seed"], done, total)))
    assert seen == [(3, 1, 2), (4, 2, 2)]
    assert found["realtime_factor"] == pytest.approx({"median": 5.0, "min": 5.0, "max": 5.0, "n": 2})
    assert found["over_physics"]["median"] == pytest.approx(2.0)
    assert found["mission_wall_s"]["median"] == pytest.approx(0.060)
    assert found["bare_factor"]["median"] == pytest.approx(10.0)
    assert found["robot_cycle_us"] == {"p50": 2000.0, "p99": 2000.0, "max": 2000.0}
    assert found["tick_us"]["max"] == 0.0
    parts = {"physics": 0.030, "robot": 0.030, "tree": 0.0, "record": 0.0, "rest": 0.0}
    assert found["breakdown_s"] == pytest.approx(parts, abs=1e-9)
    assert found["same_end_state"] is True
    assert found["targets"]["realtime_factor"] == {"least": 15.0, "met": False}
    assert found["succeeded"] == 2
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == found
    with (tmp_path / "out" / "trials.csv").open() as f:
        rows = list(csv.DictReader(f))
    assert [r["seed"] for r in rows] == ["3", "4"]
    assert {r["steps"] for r in rows} == {"300"}
    assert (tmp_path / "out" / "s3" / "report.html").exists()


def test_a_replay_that_ends_elsewhere_is_told(
    house: ModuleType, clock: Clock, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    furnish(house, clock, monkeypatch, BareSteps(300, 0.030, 0.030, False))
    assert speed.run_study(study(tmp_path, seeds=(0,)))["same_end_state"] is False


def test_a_backend_without_a_trace_is_refused(
    house: ModuleType, clock: Clock, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    furnish(house, clock, monkeypatch, None)
    with pytest.raises(BadInput, match="kept no trace"):
        speed.run_study(study(tmp_path))


def test_time_goes_to_the_part_that_spent_it(house: ModuleType, clock: Clock) -> None:
    """A cycle of 10 s, then a tick: 3 s up to an event of `match` that takes 5 s to write, then 4 s of `grasp`."""
    times = CycleTimes()

    class Plain(house.NullRobot):  # type: ignore[name-defined,misc]
        def cycle(self, command: object) -> Observation:
            clock.now += 10.0
            observation: Observation = super().cycle(command)
            return observation

    class Writer:
        def block(self, *given: object) -> None:
            clock.now += 1.0

        def tick(self, *given: object) -> None:
            clock.now += 2.0

        def event(self, *given: object) -> None:
            clock.now += 5.0

        def port(self, *given: object) -> None:
            clock.now += 0.5

    robot = TimedRobot(Plain(0), times)
    record = TimedRecord(Writer(), robot)
    robot.observe()
    observation = robot.cycle(Command())
    record.block(observation, Command())
    clock.now += 3.0
    record.event("ranking", 0.0, {"node": "match"})
    clock.now += 4.0
    record.tick(
        0.0, [("root", "RUNNING", "RUNNING"), ("root/match", "RUNNING", "INVALID"), ("root/grasp", "", "RUNNING")]
    )
    record.port(0.0, "plan", None)
    robot.cycle(Command())
    assert times.robot == [10.0, 10.0]
    assert times.tree == [0.0, 7.0]
    assert times.record == [0.0, 8.5]
    assert times.whole == [0.0, 25.5]
    assert times.leaf == {"": 0.0, "match": 3.0, "grasp": 4.0}


def test_a_cycle_that_raises_is_timed_too(house: ModuleType, clock: Clock) -> None:
    class Broken(house.NullRobot):  # type: ignore[name-defined,misc]
        def cycle(self, command: object) -> Observation:
            clock.now += 1.5
            raise BadInput("no")

    times = CycleTimes()
    robot = TimedRobot(Broken(0), times)
    robot.observe()
    with pytest.raises(BadInput):
        robot.cycle(Command())
    assert times.robot == [1.5]


def test_medians_and_quantiles() -> None:
    assert speed.spread([3.0, 1.0, 2.0]) == {"median": 2.0, "min": 1.0, "max": 3.0, "n": 3}
    assert speed.quantiles_us(np.arange(101) * 1e-6) == {"p50": 50.0, "p99": 99.0, "max": 100.0}
    assert speed.quantiles_us([]) == {"p50": 0.0, "p99": 0.0, "max": 0.0}


def test_targets_are_met_or_not() -> None:
    row = dict.fromkeys(speed.COLUMNS, 1.0) | {"same_end_state": True, "status": "success"}
    good = speed.summarise([SpeedTrial(row | {"realtime_factor": 15.0, "over_physics": 2.0}, CycleTimes())])
    assert all(t["met"] for t in good["targets"].values())
    slow = speed.summarise([SpeedTrial(row | {"realtime_factor": 14.9, "over_physics": 2.1}, CycleTimes())])
    assert not any(t["met"] for t in slow["targets"].values())


def test_a_backend_is_needed_with_a_referee(house: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Blind(house.NullBackend):  # type: ignore[name-defined,misc]
        def open(self, world: Any, conditions: Any, seed: int, options: Mapping[str, object]) -> Robot:
            robot: Robot = house.NullRobot(seed)
            return robot

    assert issubclass(Blind, Backend)
    monkeypatch.setattr(speed, "load_backend", lambda name: Blind())
    with pytest.raises(BadInput, match="cannot repeat its steps"):
        speed.run_study(study(tmp_path))
