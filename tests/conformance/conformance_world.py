"""World of the conformance tests: an empty corner of the container, whose floor is the known wall."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import glotouch_missions
from glotouch_bt.conformance import Wall
from glotouch_bt.robot import Container, Holder, ObjectSet, Pose, Probe, RobotDescription, World

K = Pose.planar((0.60, 0.0, -0.20), 0.0)
OBJECTS = Path(glotouch_missions.__file__).parent / "objects"
NAME = sorted(p.stem for p in OBJECTS.glob("*.stl"))[0]
WORLD = World(
    name="conformance",
    container=Container(pose_B_K=K, interior_m=(0.30, 0.40, 0.08)),
    probe=Probe(),
    holder=Holder(pose_B_grasp=Pose.pointing_down((0.45, -0.32, -0.06), np.pi)),
    objects=ObjectSet(folder=OBJECTS, names=(NAME,)),
)
OPTIONS = {"layout": {NAME: (0.08, 0.13, 0.0)}}


def floor(description: RobotDescription) -> Wall:
    """Return the container's floor as a wall for the bare fingertips."""
    tip = np.array([0.0, 0.0, description.gripper.fingertip_below_P_m])
    start = Pose.pointing_down((0.58, -0.06, -0.10), np.pi)
    return Wall(K.position_m, np.array([0.0, 0.0, 1.0]), tip, 0.001, start)
