"""Check on a private copy of the world whether bodies could move without touching the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Protocol

import mujoco
import numpy as np

from glotouch_backends.mujoco.model import Handles
from glotouch_bt.robot import Pose
from glotouch_bt.robot.simulation import PathBlocked

PENETRATION_M = 0.0005
"""Largest penetration of resting bodies; a moved body may not end deeper in another one. Source: ours."""


class Posed(Protocol):
    """The parts of a simulated robot that the check reads."""

    model: mujoco.MjModel
    data: mujoco.MjData
    handles: Handles


class MotionClearance:
    """Collision check of planned moves.

    Args:
        robot: The simulated robot; only read.
    """

    def __init__(self, robot: Posed) -> None:
        self._robot = robot
        model = robot.model
        hand = robot.handles.hand_bodies.start
        self._arm = frozenset(np.flatnonzero(model.body_rootid == model.body_rootid[hand]).tolist())
        self._container = robot.handles.container_body

    def held(self) -> frozenset[int]:
        """Return the bodies that must not be touched: the robot, its probe, and objects that only they carry."""
        touching = self._pairs(self._scratch())
        handles = self._robot.handles
        own, objects = set(self._arm) | {handles.probe_body, handles.tip_body}, set(handles.object_bodies)
        while new := {b for b in objects - own if touching.get(b) and touching[b] <= own}:
            own |= new
        return frozenset(own)

    def require(
        self, moved: Set[int], way: Sequence[Mapping[int, Pose]] = (), *, rests: bool = True, container: bool = False
    ) -> None:
        """Check that bodies can move along a path without touching the robot.

        Args:
            moved: The bodies that move together; none of the robot's.
            way: Their poses in B, step by step; a step leaves unnamed bodies in place.
            rests: True if they stay at the end of the path, where they must not penetrate any other body.
            container: True if the container is one of them.

        Raises:
            PathBlocked: The robot touches one of them now or on the path, or the end is occupied.
        """
        own = self.held()
        scratch = self._scratch()
        self._look(scratch, moved, own)
        for poses in way:
            if container:  # MuJoCo computes the poses of bodies without joints only when its data are created
                scratch = self._with_container(poses[self._container])
            for body, pose in poses.items():
                if body != self._container:
                    start = int(self._robot.model.jnt_qposadr[self._robot.model.body_jntadr[body]])
                    scratch.qpos[start : start + 7] = [*pose.position_m, *pose.quat]
            mujoco.mj_kinematics(self._robot.model, scratch)
            self._look(scratch, moved, own)
        ends = zip(scratch.contact, self._bodies(scratch), strict=True) if way and rests else ()
        for contact, (one, other) in ends:
            if (one in moved) != (other in moved) and contact.dist < -PENETRATION_M:
                raise PathBlocked(f"{self._name(one)} and {self._name(other)} would overlap")

    def _look(self, scratch: mujoco.MjData, moved: Set[int], own: Set[int]) -> None:
        mujoco.mj_collision(self._robot.model, scratch)
        for one, other in self._bodies(scratch):
            if (one in moved and other in own) or (one in own and other in moved):
                raise PathBlocked(f"{self._name(one)} touches {self._name(other)}")

    def _scratch(self) -> mujoco.MjData:
        """Return a copy of the present world, positions only."""
        scratch = mujoco.MjData(self._robot.model)
        scratch.qpos[:] = self._robot.data.qpos
        mujoco.mj_kinematics(self._robot.model, scratch)
        mujoco.mj_collision(self._robot.model, scratch)
        return scratch

    def _with_container(self, pose: Pose) -> mujoco.MjData:
        """Return a copy with the container at another pose; the model is restored."""
        model, body = self._robot.model, self._container
        before = model.body_pos[body].copy(), model.body_quat[body].copy()
        model.body_pos[body], model.body_quat[body] = pose.position_m, pose.quat
        try:
            return self._scratch()
        finally:
            model.body_pos[body], model.body_quat[body] = before

    def _bodies(self, scratch: mujoco.MjData) -> list[tuple[int, int]]:
        """Return the two bodies of each contact."""
        pairs = self._robot.model.geom_bodyid[np.asarray(scratch.contact.geom).reshape(-1, 2)]
        return [(int(a), int(b)) for a, b in pairs]

    def _pairs(self, scratch: mujoco.MjData) -> dict[int, set[int]]:
        found: dict[int, set[int]] = {}
        for one, other in self._bodies(scratch):
            found.setdefault(one, set()).add(other)
            found.setdefault(other, set()).add(one)
        return found

    def _name(self, body: int) -> str:
        return str(self._robot.model.body(body).name)
