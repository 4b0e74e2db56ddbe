"""A simulated arm brought up through the vendor's API alone, for tests of the simulated devices."""

from __future__ import annotations

from typing import Any

import numpy as np

from glotouch_backends.flexiv_xense.simulated import ROBOT_SN, SimulatedVendor, open_vendor
from glotouch_backends.options import WorldOptions
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_backends.trial_message import trial_message
from glotouch_bt.robot import Array, Conditions
from tests.conformance.conformance_world import OPTIONS, WORLD

P_IN_E = [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0]
LIMITS = (0.375, 2.0, 3.0, 10.0)


def vendor(conditions: Conditions | None = None, seed: int = 0) -> SimulatedVendor:
    return open_vendor(trial_message(WORLD, conditions or Conditions(), seed, WorldOptions(**OPTIONS)))


class Bench:
    """The arm, brought up step by step."""

    def __init__(self, conditions: Conditions | None = None, seed: int = 0) -> None:
        self.vendor = vendor(conditions, seed)
        self.rdk: Any = self.vendor.flexivrdk
        self.clock = self.vendor.clock
        self.robot: Any = self.rdk.Robot(ROBOT_SN)

    def sleep(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now_s() + seconds)

    def wait(self, reached: Any, limit_s: float = 30.0) -> None:
        until = self.clock.now_s() + limit_s
        while not reached():
            assert self.clock.now_s() < until
            self.sleep(0.01)

    def enable(self) -> Bench:
        self.robot.Enable()
        self.wait(self.robot.operational)
        return self

    def tool(self) -> Bench:
        tools, params = self.rdk.Tool(self.robot), self.rdk.ToolParams()
        params.mass, com = RIZON4_XENSE.gripper.mass_and_com_E()
        params.CoM, params.tcp_location = com.tolist(), P_IN_E
        tools.Add("hand", params)
        tools.Switch("hand")
        return self

    def zero(self) -> Bench:
        self.robot.SwitchMode(self.rdk.Mode.NRT_PRIMITIVE_EXECUTION)
        self.robot.ExecutePrimitive("ZeroFTSensor", {"dataCollectTime": 0.2})
        self.wait(lambda: self.robot.primitive_states()["terminated"])
        return self

    def cartesian(self) -> Bench:
        self.enable().tool().zero()
        self.robot.SwitchMode(self.rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)
        self.robot.SetNullSpacePosture(list(RIZON4_XENSE.home_q))
        return self

    @property
    def pose(self) -> Array:
        """(7,) of the tool centre point."""
        return np.array(self.robot.states().tcp_pose)

    def stream(self, velocity: tuple[float, float, float], seconds: float) -> Array:
        """Send setpoints at 100 Hz along a line at constant speed; return the positions (n, 3) after each period."""
        start, v, track = self.pose, np.array(velocity), []
        begin = self.clock.now_s()
        for k in range(1, round(seconds / 0.01) + 1):
            goal = [*(start[:3] + v * 0.01 * k), *start[3:]]
            self.robot.SendCartesianMotionForce(goal, [0.0] * 6, [*v, 0.0, 0.0, 0.0], *LIMITS)
            self.clock.sleep_until(begin + 0.01 * k)
            track.append(self.pose[:3])
        return np.array(track)
