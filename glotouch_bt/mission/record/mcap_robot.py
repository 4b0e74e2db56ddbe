"""The robot in the 3D view of a record: its frames (/tf) and the shapes of its parts (foxglove.SceneUpdate).

Frames: B arm base, link1 ... each joint's, E flange, P mid-point of the pads, left and right the fingers in P.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import numpy.typing as npt

from glotouch_bt.mission.record.mcap_scene import Json3D, colour, cube, pose_json, sphere
from glotouch_bt.robot import Array, Box, Capsule, Pose, RobotDescription, matrix_to_quat, rpy_to_matrix

_HOUSING, _HAND, _FINGER = colour(0.87, 0.89, 0.91), colour(0.35, 0.38, 0.44), colour(0.50, 0.53, 0.57)
_TIME = '{"sec":%d,"nsec":%d}'
_PLACE, _TURN = '{"x":%.6f,"y":%.6f,"z":%.6f}', '{"x":%.7f,"y":%.7f,"z":%.7f,"w":%.7f}'


class LinkFrames:
    """The transforms of all frames of a robot as text, for many stamps at once.

    Args:
        description: The robot, or None if it is not described: P only.
        fixed: Frames that do not move, in B, by name; they are repeated, so that a viewer that jumps knows them.
    """

    def __init__(self, description: RobotDescription | None, fixed: Mapping[str, Pose]) -> None:
        joints = () if description is None else description.joints
        turns = [_turn(matrix_to_quat(rpy_to_matrix(j.origin_rpy_rad)), np.array(j.axis)) for j in joints]
        self._turns: Array = np.array(turns).reshape(-1, 2, 4)
        self._fingers = description is not None
        names = ["B", *(f"link{i + 1}" for i in range(len(joints)))]
        parts = [_frame("B", "P", _PLACE, _TURN)]
        for above, name, joint in zip(names[:-1], names[1:], joints, strict=True):
            parts.append(_frame(above, name, _PLACE % tuple(joint.origin_m), _TURN))
        if description is not None:
            parts += [_frame("P", side, '{"x":0,"y":%.6f,"z":0}', _TURN % (0, 0, 0, 1)) for side in ("left", "right")]
            fixed = {**fixed, "E": description.pose_last_E}
        for name, pose in fixed.items():
            w, *axis = pose.quat.tolist()
            above = names[-1] if name == "E" else "B"
            parts.append(_frame(above, name, _PLACE % tuple(pose.position_m.tolist()), _TURN % (*axis, w)))
        self._fixed = len(fixed)
        self.template = f'{{"transforms":[{",".join(parts)}]}}'

    def columns(
        self, stamps_ns: npt.NDArray[np.int64], position_B_P: Array, quat_B_P: Array, q: Array, aperture_m: Array
    ) -> list[Array]:
        """Return what fills the template, a row for each stamp: P (n, 3), w x y z (n, 4), q (n, dof), jaws (n,)."""
        stamp: Array = np.column_stack([stamps_ns // 10**9, stamps_ns % 10**9]).astype(np.float64)
        out = [stamp, position_B_P, quat_B_P[:, [1, 2, 3, 0]]]
        half = 0.5 * q[:, : len(self._turns), None]
        turned = np.cos(half) * self._turns[:, 0] + np.sin(half) * self._turns[:, 1]
        for joint in range(len(self._turns)):
            out += [stamp, turned[:, joint]]
        if self._fingers:
            out += [stamp, 0.5 * aperture_m, stamp, -0.5 * aperture_m]
        return out + [stamp] * self._fixed


def _frame(above: str, name: str, place: str, turn: str) -> str:
    return (
        f'{{"timestamp":{_TIME},"parent_frame_id":"{above}","child_frame_id":"{name}",'
        f'"translation":{place},"rotation":{turn}}}'
    )


def _turn(zero: Array, axis: Array) -> tuple[Array, Array]:
    """Return the quaternions x y z w that make a fixed rotation w x y z (4,), then a turn about an axis (3,).

    They are for the cosine and the sine of half the angle.
    """
    w, v = zero[0], zero[1:]
    return np.append(v, w), np.append(w * axis + np.cross(v, axis), -(v @ axis))


def robot_shapes(description: RobotDescription) -> Iterator[tuple[str, Json3D]]:
    """Yield the frame and the primitives of each part of the robot."""
    yield "B", _capsules(description.base.capsules)
    for i, joint in enumerate(description.joints):
        yield f"link{i + 1}", _capsules(joint.link.capsules)
    hand = description.gripper
    yield "E", {"cubes": [_box(b, _HAND) for b in hand.body]}
    x, y, z = hand.finger.centre_m
    for frame, side in (("left", 1.0), ("right", -1.0)):
        yield frame, {"cubes": [_box(Box(centre_m=(x, side * y, z), half_m=hand.finger.half_m), _FINGER)]}


def _box(box: Box, shade: Json3D) -> Json3D:
    return cube(box.centre_m, tuple(2.0 * h for h in box.half_m), shade)


def _capsules(capsules: tuple[Capsule, ...]) -> Json3D:
    cylinders, spheres = [], []
    for c in capsules:
        start, end = np.array(c.start_m), np.array(c.end_m)
        length = float(np.linalg.norm(end - start))
        spheres += [sphere(c.start_m, c.radius_m, _HOUSING), sphere(c.end_m, c.radius_m, _HOUSING)]
        if length > 0.0:
            size = {"x": 2.0 * c.radius_m, "y": 2.0 * c.radius_m, "z": length}
            pose = pose_json(tuple(0.5 * (start + end)), _quat_of_z((end - start) / length))
            cylinders.append({"pose": pose, "size": size, "bottom_scale": 1.0, "top_scale": 1.0, "color": _HOUSING})
    return {"cylinders": cylinders, "spheres": spheres}


def _quat_of_z(direction: Array) -> tuple[float, float, float, float]:
    """Return the shortest rotation w x y z of z onto a unit vector."""
    x, y, z = direction.tolist()
    if z < -1.0 + 1e-9:
        return (0.0, 1.0, 0.0, 0.0)
    w = np.sqrt(0.5 * (1.0 + z))
    return (float(w), float(-0.5 * y / w), float(0.5 * x / w), 0.0)
