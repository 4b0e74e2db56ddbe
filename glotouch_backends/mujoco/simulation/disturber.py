"""Changes of the simulated world for faults: they edit MuJoCo's state between two cycles.

`MotionClearance` is checked first; a move that is blocked raises `PathBlocked` and changes nothing.
    (`PathBlocked`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import mujoco
import numpy as np

from glotouch_backends.mujoco.sensing import GRAVITY_M_S2, body_pose
from glotouch_backends.mujoco.simulation.clearance import MotionClearance, Posed
from glotouch_backends.mujoco.truth import Truth, rotation_vector
from glotouch_bt.robot import Array, BadInput, Pose, World

PARKING_B_M = (-0.7, 0.8)
"""First place of removed objects on the table, out of the arm's reach, in B."""
PARKING_STEP_M = 0.25
"""Distance between two removed objects."""
LIFT_M = 0.002
"""Height above the floor from which an object is dropped when it is placed."""
PATH_STEP_M = 0.002
"""Distance between two checked poses of a path; the probe's shaft is three times as thick. Source: ours."""
TURN_STEP_RAD = np.deg2rad(5.0)
"""Angle between two checked poses of a turn. Source: ours."""
MIN_FRICTION = 0.3
"""Friction coefficient that gives the longest slide of a knocked object. Source: ours."""


class Disturbed(Posed, Protocol):
    """The parts of a simulated robot that its disturber may change."""

    world: World
    truth: Truth


class MujocoDisturber:
    """See `robot.simulation.Disturber`."""

    def __init__(self, robot: Disturbed) -> None:
        self._robot = robot
        self._clearance = MotionClearance(robot)
        self._from: dict[int, Pose] = {}

    def places_B_m(self) -> Array:
        """See `Disturber`."""
        return np.array(self._robot.data.xipos[list(self._robot.handles.object_bodies)])

    def shove(self, index: int, velocity_B_m_s: Array) -> None:
        """See `Disturber`."""
        r, velocity = self._robot, np.asarray(velocity_B_m_s, dtype=np.float64)
        body = r.handles.object_bodies[index]
        speed = float(np.linalg.norm(velocity))
        far = velocity * speed / (2.0 * MIN_FRICTION * GRAVITY_M_S2)
        pose, count = self._pose(index), int(np.ceil(np.linalg.norm(far) / PATH_STEP_M))
        steps = np.linspace(0.0, 1.0, count + 1)[1:, None] * np.array([*far, 0.0])
        self._clearance.require({body}, [{body: Pose(pose.position_m + s, pose.quat)} for s in steps], rests=False)
        r.data.qvel[self._dof(index)][:2] += velocity

    def topple(self, index: int, about_rad: float) -> float:
        """See `Disturber`."""
        r = self._robot
        body = r.handles.object_bodies[index]
        before = np.array(r.data.xipos[body])
        pose = self._pose(index)
        axis = np.array([np.cos(about_rad), np.sin(about_rad), 0.0])
        floor_m, centre_O = self._lowest(index, pose), pose.inverse().apply(before)

        def turned(angle_rad: float) -> Pose:
            """Return the pose turned about the centre of mass and lifted off the floor."""
            quat = (Pose(np.zeros(3), rotation_vector(angle_rad * axis).quat) @ Pose(np.zeros(3), pose.quat)).quat
            at = Pose(before - Pose(np.zeros(3), quat).apply(centre_O), quat)
            rise = floor_m + LIFT_M - self._lowest(index, at)
            return Pose(at.position_m + np.array([0.0, 0.0, rise]), quat)

        angles = np.linspace(0.0, 0.5 * np.pi, round(0.5 * np.pi / TURN_STEP_RAD) + 1)[1:]
        self._clearance.require({body}, [{body: turned(float(a))} for a in angles])
        self._place(index, turned(0.5 * np.pi))
        return float(np.linalg.norm(r.data.xipos[body] - before))

    def remove(self, index: int) -> None:
        """See `Disturber`."""
        r, pose = self._robot, self._pose(index)
        self._clearance.require({r.handles.object_bodies[index]})
        self._from[index] = pose
        table_z = float(r.world.container.pose_B_K.position_m[2]) - r.world.container.wall_m
        place = np.array([PARKING_B_M[0], PARKING_B_M[1] - PARKING_STEP_M * index, 0.0])
        away = Pose(place, pose.quat)
        self._place(index, Pose(place + np.array([0.0, 0.0, table_z + LIFT_M - self._lowest(index, away)]), pose.quat))

    def put_back(self, index: int) -> None:
        """See `Disturber`."""
        was = self._from[index]
        there = Pose(was.position_m + np.array([0.0, 0.0, LIFT_M]), was.quat)
        body = self._robot.handles.object_bodies[index]
        self._clearance.require({body}, [{body: there}])
        del self._from[index]
        self._place(index, there)

    def shift_container(self, shift_B_m: Array, yaw_rad: float) -> None:
        """See `Disturber`."""
        r = self._robot
        old, body = r.truth.pose_B_K, r.handles.container_body
        away, held = set(self._from), self._clearance.held()
        inside = [i for i, b in enumerate(r.handles.object_bodies) if i not in away and b not in held]
        places = {i: self._pose(i) for i in inside}

        def moved(share: float) -> tuple[Pose, dict[int, Pose]]:
            """Return the poses of the container and of each body after a share of the path."""
            turn = old @ Pose.planar((0.0, 0.0, 0.0), share * yaw_rad)
            new = Pose(old.position_m + share * np.array([*shift_B_m, 0.0]), turn.quat)
            change = new @ old.inverse()
            return new, {r.handles.object_bodies[i]: change @ places[i] for i in inside}

        interior = r.world.container.interior_m
        longest = float(np.linalg.norm(shift_B_m)) + abs(yaw_rad) * 0.5 * float(np.hypot(interior[0], interior[1]))
        count = max(1, int(np.ceil(longest / PATH_STEP_M)))
        way = [{body: new, **poses} for new, poses in (moved(float(s)) for s in np.linspace(0.0, 1.0, count + 1)[1:])]
        self._clearance.require({body, *(r.handles.object_bodies[i] for i in inside)}, way, container=True)
        new, _ = moved(1.0)
        change = new @ old.inverse()
        r.model.body_pos[body], r.model.body_quat[body] = new.position_m, new.quat
        self._refresh_static_bodies()
        r.truth = replace(r.truth, pose_B_K=new)
        for index in inside:
            self._place(index, change @ places[index])

    def _refresh_static_bodies(self) -> None:
        """Update the poses of bodies without joints: MuJoCo computes them only when its data are created or reset."""
        model, data = self._robot.model, self._robot.data
        fresh = mujoco.MjData(model)
        bodies = np.flatnonzero(model.body_weldid == 0)
        for name in ("xpos", "xquat", "xmat", "xipos", "ximat"):
            getattr(data, name)[bodies] = getattr(fresh, name)[bodies]
        for kind in ("geom", "site"):
            of = np.flatnonzero(np.isin(getattr(model, f"{kind}_bodyid"), bodies))
            for name in ("xpos", "xmat"):
                getattr(data, f"{kind}_{name}")[of] = getattr(fresh, f"{kind}_{name}")[of]

    def _pose(self, index: int) -> Pose:
        """Return a copy of an object's pose.

        Raises:
            BadInput: The objects are bolted down.
        """
        self._joint(index)
        pose = body_pose(self._robot.data, self._robot.handles.object_bodies[index])
        return Pose(np.array(pose.position_m), np.array(pose.quat))

    def _joint(self, index: int) -> int:
        joint = int(self._robot.model.body_jntadr[self._robot.handles.object_bodies[index]])
        if joint < 0:
            raise BadInput("the objects are bolted to the floor (backend option `fixed`) and cannot be moved")
        return joint

    def _dof(self, index: int) -> slice:
        start = int(self._robot.model.jnt_dofadr[self._joint(index)])
        return slice(start, start + 6)

    def _place(self, index: int, pose_B_O: Pose) -> None:
        """Put a body at a pose, at rest, and update everything that follows from positions."""
        r = self._robot
        start = int(r.model.jnt_qposadr[self._joint(index)])
        r.data.qpos[start : start + 7] = [*pose_B_O.position_m, *pose_B_O.quat]
        r.data.qvel[self._dof(index)] = 0.0
        mujoco.mj_kinematics(r.model, r.data)
        mujoco.mj_comPos(r.model, r.data)

    def _lowest(self, index: int, pose_B_O: Pose) -> float:
        """Return the height in B of an object's lowest vertex at a pose."""
        return float(pose_B_O.apply(self._robot.truth.objects[index].mesh.vertices_m)[:, 2].min())
