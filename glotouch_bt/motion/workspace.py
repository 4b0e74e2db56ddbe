"""Reach check of the places where a mission works: the whole container, and the stand of the probe."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from glotouch_bt.motion.kinematics import Kinematics
from glotouch_bt.robot import MotionRefused, Pose, RobotDescription, World

YAWS_RAD = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi)
"""Directions of the hand that are tried at a place, from x of its frame; one that works is enough."""
BARE_INSET_M = 0.03
"""Distance from the walls at which the bare hand works at the floor. Source: ours; half an object and a finger."""
RISE_M = 0.05
"""Height above the rim, and above the stand, at which the hand travels. Source: ours."""


def out_of_reach(description: RobotDescription, world: World) -> list[str]:
    """Return what the hand cannot reach while it points down, one sentence each; empty if it reaches everything.

    Checked are the corners of the container with the probe's ball at the floor and above the rim, and with the bare
    fingertips at the floor; and the probe in its stand and just above. Obstacles do not count.
    """
    kinematics = Kinematics(description)
    box, probe, tips_m = world.container, world.probe, description.gripper.fingertip_below_P_m
    x, y, z = box.interior_m
    held_m = probe.grasp_to_tip_m
    levels = (
        ("with the probe at the floor", probe.tip_radius_m, probe.tip_radius_m + held_m),
        ("with the probe above the rim", probe.tip_radius_m, z + RISE_M + held_m),
        ("with the bare hand at the floor", BARE_INSET_M, tips_m),
    )
    faults = []
    for what, inset_m, height_m in levels:
        half = [max(0.0, 0.5 * side - inset_m) for side in (x, y)]
        for sx, sy in product((-1, 1), repeat=2):
            why = _blocked(kinematics, box.pose_B_K @ Pose.planar((sx * half[0], sy * half[1], height_m), 0.0))
            if why:
                faults.append(f"the corner {'+-'[sx < 0]}x {'+-'[sy < 0]}y of the container, {what}: {why}")
                break
    grasp = world.holder.pose_B_grasp
    for what, up_m in (("in its stand", 0.0), ("above its stand", RISE_M + probe.length_m)):
        place = Pose.planar(grasp.position_m + np.array([0.0, 0.0, up_m]), grasp.yaw_rad)
        if why := _blocked(kinematics, place):
            faults.append(f"the probe {what}: {why}")
            break
    return faults


def _blocked(kinematics: Kinematics, place: Pose) -> str:
    """Return why P cannot be at a place (upright frame in B) with the hand pointing down; empty if it can."""
    why, seed = "", kinematics.home_towards(place.position_m)
    for yaw in YAWS_RAD:
        try:
            kinematics.ik(Pose.pointing_down(place.position_m, place.yaw_rad + yaw), seed)
        except MotionRefused as e:
            why = why or e.why
            continue
        return ""
    return why
