"""Run as a process: brings the arm of a simulated cell up and moves it until it is killed.

python -m tests.backends.flexiv_xense.cell_client ADDRESS SPEED_M_S
"""

from __future__ import annotations

import sys
from typing import Any

from glotouch_backends.flexiv_xense.simulated import ROBOT_SN, open_remote_vendor

REACH_M = 0.08


def main(address: str, speed_m_s: float) -> None:
    vendor = open_remote_vendor(address)
    rdk, clock = vendor.flexivrdk, vendor.clock
    robot: Any = rdk.Robot(ROBOT_SN)
    robot.Enable()
    while not robot.operational():
        clock.sleep_until(clock.now_s() + 0.05)
    robot.SwitchMode(rdk.Mode.NRT_PRIMITIVE_EXECUTION)
    robot.ExecutePrimitive("ZeroFTSensor", {"dataCollectTime": 0.1})
    while not robot.primitive_states()["terminated"]:
        clock.sleep_until(clock.now_s() + 0.02)
    robot.SwitchMode(rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)
    start = robot.states().tcp_pose
    print("moving", flush=True)
    offset, direction, began = 0.0, 1.0, clock.now_s()
    while True:
        offset += direction * speed_m_s * 0.01
        if abs(offset) > REACH_M:
            direction = -direction
        goal = [start[0], start[1] + offset, *start[2:]]
        twist = [0.0, direction * speed_m_s, 0.0, 0.0, 0.0, 0.0]
        robot.SendCartesianMotionForce(goal, [0.0] * 6, twist, 0.5, 2.0, 3.0, 10.0)
        began += 0.01
        clock.sleep_until(began)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
