"""Whether a part of the world could be moved without touching the robot, asked of a copy that nobody else sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Protocol

import mujoco
import numpy as np

from glotouch_backends.mujoco.model import Handles
from glotouch_bt.robot import Pose
from glotouch_bt.robot.simulation import PathBlocked

PENETRATION_M = 0.0005
"""What stands or leans on something is so deep in it at most; what is moved may end no deeper in anything."""


class Posed(Protocol):
    """What is looked at."""

    model: mujoco.MjModel
    data: mujoco.MjData
    handles: Handles


class MotionClearance:
    """See the module's text.

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
        """Bodies that are not to be moved or met: the robot's, its probe, and objects that nothing but they carry."""
        touching = self._pairs(self._scratch())
        own, objects = set(self._arm) | {self._robot.handles.probe_body}, set(self._robot.handles.object_bodies)
        while new := {b for b in objects - own if touching.get(b) and touching[b] <= own}:
            own |= new
        return frozenset(own)

    def require(
        self, moved: Set[int], way: Sequence[Mapping[int, Pose]] = (), *, rests: bool = True, container: bool = False
    ) -> None:
        """Make sure that bodies can go along a way without meeting the robot.

        Args:
            moved: The bodies that go together; those of the robot's are never among them.
            way: Where they are (B), step by step; what a step does not name stays.
            rests: They are put at the end of the way: there they must be clear of all else, too.
            container: The container is one of them.

        Raises:
            PathBlocked: The robot touches one of them now, is in the way, or the place is taken.
        """
        own = self.held()
        scratch = self._scratch()
        self._look(scratch, moved, own)
        for poses in way:
            if container:  # MuJoCo computes where bodies without joints stand once, when its data are made
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
                raise PathBlocked(f"{self._name(one)} and {self._name(other)} would be in one place")

    def _look(self, scratch: mujoco.MjData, moved: Set[int], own: Set[int]) -> None:
        mujoco.mj_collision(self._robot.model, scratch)
        for one, other in self._bodies(scratch):
            if (one in moved and other in own) or (one in own and other in moved):
                raise PathBlocked(f"{self._name(one)} meets {self._name(other)}")

    def _scratch(self) -> mujoco.MjData:
        """A copy of the world as it is now, positions only."""
        scratch = mujoco.MjData(self._robot.model)
        scratch.qpos[:] = self._robot.data.qpos
        mujoco.mj_kinematics(self._robot.model, scratch)
        mujoco.mj_collision(self._robot.model, scratch)
        return scratch

    def _with_container(self, pose: Pose) -> mujoco.MjData:
        """The same with the container elsewhere; the model is as it was afterwards."""
        model, body = self._robot.model, self._container
        before = model.body_pos[body].copy(), model.body_quat[body].copy()
        model.body_pos[body], model.body_quat[body] = pose.position_m, pose.quat
        try:
            return self._scratch()
        finally:
            model.body_pos[body], model.body_quat[body] = before

    def _bodies(self, scratch: mujoco.MjData) -> list[tuple[int, int]]:
        """The two bodies of each contact."""
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
