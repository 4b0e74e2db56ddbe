"""Hands inside the simulated world, for faults: they change MuJoCo's state between two cycles."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import mujoco
import numpy as np

from backends.mujoco.model import Handles
from backends.mujoco.tactile import body_pose
from backends.mujoco.truth import Truth, rotation_vector
from glotouch_bt.robot import Array, BadInput, Pose, World

AWAY_B_M = (-0.7, 0.8)
"""On the table, out of the arm's way; removed objects stand there in a row."""
AWAY_STEP_M = 0.25
LIFT_M = 0.002
"""What is put down is put down from so high."""


class Disturbed(Protocol):
    """What a simulated robot lets its disturber change."""

    world: World
    truth: Truth
    model: mujoco.MjModel
    data: mujoco.MjData
    handles: Handles


class MujocoDisturber:
    """See `robot.disturber.Disturber`."""

    def __init__(self, robot: Disturbed) -> None:
        self._robot = robot
        self._from: dict[int, Pose] = {}

    def places_B_m(self) -> Array:
        """(n, 3) the objects' centres of mass."""
        return np.array(self._robot.data.xipos[list(self._robot.handles.object_bodies)])

    def shove(self, index: int, velocity_B_m_s: Array) -> None:
        """See `Disturber`."""
        self._robot.data.qvel[self._dof(index)][:2] += np.asarray(velocity_B_m_s)

    def topple(self, index: int, about_rad: float) -> float:
        """See `Disturber`."""
        r = self._robot
        body = r.handles.object_bodies[index]
        before = np.array(r.data.xipos[body])
        axis = np.array([np.cos(about_rad), np.sin(about_rad), 0.0])
        pose = body_pose(r.data, body)
        floor_m = self._lowest(index, pose)
        turned = Pose(np.zeros(3), rotation_vector(0.5 * np.pi * axis).quat) @ Pose(np.zeros(3), pose.quat)
        centre_O = pose.inverse().apply(before)
        laid = Pose(before - turned.apply(centre_O), turned.quat)
        rise = floor_m + LIFT_M - self._lowest(index, laid)
        self._place(index, Pose(laid.position_m + np.array([0.0, 0.0, rise]), laid.quat))
        return float(np.linalg.norm(r.data.xipos[body] - before))

    def remove(self, index: int) -> None:
        """See `Disturber`."""
        r = self._robot
        pose = body_pose(r.data, r.handles.object_bodies[index])
        self._from[index] = Pose(np.array(pose.position_m), np.array(pose.quat))
        table_z = float(r.world.container.pose_B_K.position_m[2]) - r.world.container.wall_m
        place = np.array([AWAY_B_M[0], AWAY_B_M[1] - AWAY_STEP_M * index, 0.0])
        away = Pose(place, pose.quat)
        self._place(index, Pose(place + np.array([0.0, 0.0, table_z + LIFT_M - self._lowest(index, away)]), pose.quat))

    def put_back(self, index: int) -> None:
        """See `Disturber`."""
        pose = self._from.pop(index)
        self._place(index, Pose(pose.position_m + np.array([0.0, 0.0, LIFT_M]), pose.quat))

    def shift_container(self, shift_B_m: Array, yaw_rad: float) -> None:
        """See `Disturber`."""
        r = self._robot
        old = r.truth.pose_B_K
        new = Pose(old.position_m + np.array([*shift_B_m, 0.0]), (old @ Pose.planar((0.0, 0.0, 0.0), yaw_rad)).quat)
        change = new @ old.inverse()
        inside = [i for i in range(len(r.handles.object_bodies)) if i not in self._from]
        body = r.handles.container_body
        r.model.body_pos[body], r.model.body_quat[body] = new.position_m, new.quat
        self._take_up_static_bodies()
        r.truth = replace(r.truth, pose_B_K=new)
        for index in inside:
            pose = body_pose(r.data, r.handles.object_bodies[index])
            self._place(index, change @ Pose(np.array(pose.position_m), np.array(pose.quat)))

    def _take_up_static_bodies(self) -> None:
        """MuJoCo computes where bodies without joints stand once, when its data are made or reset."""
        model, data = self._robot.model, self._robot.data
        fresh = mujoco.MjData(model)
        bodies = np.flatnonzero(model.body_weldid == 0)
        for name in ("xpos", "xquat", "xmat", "xipos", "ximat"):
            getattr(data, name)[bodies] = getattr(fresh, name)[bodies]
        for kind in ("geom", "site"):
            of = np.flatnonzero(np.isin(getattr(model, f"{kind}_bodyid"), bodies))
            for name in ("xpos", "xmat"):
                getattr(data, f"{kind}_{name}")[of] = getattr(fresh, f"{kind}_{name}")[of]

    def _joint(self, index: int) -> int:
        joint = int(self._robot.model.body_jntadr[self._robot.handles.object_bodies[index]])
        if joint < 0:
            raise BadInput("the objects are bolted to the floor (backend option `fixed`): they cannot be moved")
        return joint

    def _dof(self, index: int) -> slice:
        start = int(self._robot.model.jnt_dofadr[self._joint(index)])
        return slice(start, start + 6)

    def _place(self, index: int, pose_B_O: Pose) -> None:
        """Put a body somewhere, at rest; everything that follows from positions is brought up to date."""
        r = self._robot
        start = int(r.model.jnt_qposadr[self._joint(index)])
        r.data.qpos[start : start + 7] = [*pose_B_O.position_m, *pose_B_O.quat]
        r.data.qvel[self._dof(index)] = 0.0
        mujoco.mj_kinematics(r.model, r.data)
        mujoco.mj_comPos(r.model, r.data)

    def _lowest(self, index: int, pose_B_O: Pose) -> float:
        """Height in B of the lowest vertex of an object at a pose."""
        return float(pose_B_O.apply(self._robot.truth.objects[index].mesh.vertices_m)[:, 2].min())
