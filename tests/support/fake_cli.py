"""A backend and a skill without physics, for whole runs: `python fake_cli.py run ...` is `glotouch` with them."""

from __future__ import annotations

import copy
import importlib
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from glotouch_bt.robot import (
    HOLD,
    Backend,
    BackendError,
    GripperState,
    Limits,
    Observation,
    Robot,
    SafetyStop,
    UnknownName,
)
from glotouch_bt.robot.fake import FAKE_ARM
from glotouch_bt.skill import Out, Skill, SkillFailed, SkillParams, SkillRun, param


class WaitParams(SkillParams):
    seconds: float = param("duration", unit="s", default=0.1, gt=0, le=1e6)
    end: str = param("ok, fail, stop or bug", default="ok")


class Wait(Skill):
    """Wait, then end as told."""

    Params = WaitParams
    params: WaitParams
    done = Out(bool, "waited")

    def run(self) -> SkillRun:
        until = self.context.observation.now_s + self.params.seconds
        while self.context.observation.now_s < until - 1e-6:
            yield HOLD
        if self.params.end == "fail":
            raise SkillFailed("told_to", "the script says so", advice="say ok", waited_s=self.params.seconds)
        if self.params.end == "bug":
            raise ZeroDivisionError("a bug")
        if self.params.end == "stop":
            raise SafetyStop("force_N", 31.0, 30.0, self.context.observation.now_s)
        self.done = True


class NullArm:
    def __init__(self, *args: Any) -> None:
        self.not_run: list[str] = []

    def sync(self, observation: Observation) -> None:
        pass

    def state(self) -> dict[str, Any]:
        return {}

    def restore(self, state: Any) -> None:
        pass


class NullRobot(Robot):
    period_s = 0.01

    def __init__(self, seed: int) -> None:
        self.description, self.limits = FAKE_ARM, Limits()
        self._n = 0
        self._noise = np.random.default_rng(seed)
        self._newest = self._sense()

    def observe(self) -> Observation:
        return self._newest

    def _sense(self) -> Observation:
        now_s = self._n * self.period_s
        jaws = GripperState(now_s, 0.05, 0.0, False)
        return Observation(
            stamp_s=now_s + 0.001 * np.arange(-9, 1),
            q=np.zeros((10, 7)),
            dq=np.zeros((10, 7)),
            position_B_P=np.zeros((10, 3)),
            quat_B_P=np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)),
            wrench_S=self._noise.normal(scale=0.05, size=(10, 6)),
            gripper=jaws,
        )

    def cycle(self, command: object) -> Observation:
        self._n += 1
        self._newest = self._sense()
        return self._newest

    def start(self, request: object) -> Any:
        raise NotImplementedError

    def hold(self) -> None:
        pass

    def close(self) -> None:
        pass

    def snapshot(self) -> dict[str, object]:
        return {"n": self._n, "noise": copy.deepcopy(self._noise), "newest": self._newest}

    def restore(self, snapshot: Any) -> None:
        self._n, self._noise = snapshot["n"], copy.deepcopy(snapshot["noise"])
        self._newest = snapshot["newest"]


class NullBackend(Backend):
    name = "null"
    summary = "nothing happens"

    def open(self, world: Any, conditions: Any, seed: int, options: Mapping[str, object]) -> Robot:
        if "cable" in options:
            raise BackendError("the cable is out")
        if options:
            raise UnknownName("option", next(iter(options)), ["cable"])
        return NullRobot(seed)


def install_fakes(patch: Any) -> None:
    """Use this backend and skill only (patch: `monkeypatch.setattr` or `setattr`)."""
    import glotouch_bt.mission.load
    import glotouch_bt.motion

    patch(glotouch_bt.mission.load, "SkillRegistry", lambda: {"wait": Wait})
    patch(importlib.import_module("glotouch_bt.runs.launch"), "load_backend", lambda name: NullBackend())
    patch(glotouch_bt.motion, "Arm", NullArm)


if __name__ == "__main__":
    install_fakes(setattr)
    from glotouch_bt.cli import main

    sys.exit(main())
