"""Touches of standing objects with the true shapes and sensors of a trial, without physics."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.control import JawReports, force_errors
from glotouch_backends.mujoco.printed import Roughness
from glotouch_backends.mujoco.sensing import (
    DepthErrors,
    GelSensor,
    Side,
    SurfaceRays,
    TaxelErrors,
    gel_of_trial,
    imager_of_trial,
    pad_pose_P,
)
from glotouch_backends.mujoco.truth import ObjectTruth, draw_truth, rotation_vector
from glotouch_bt.robot import Array, Conditions, GelImages, GripperState, Pose, RobotDescription, TactileFrame, World
from glotouch_bt.robot.scene import Mesh, stream
from glotouch_bt.robot.simulation import Place, SampledClosure, TouchSampler

CLOSURE_S = 4.0
"""Robot time between two closures, in which the gel recovers. Source: ours."""
FRAMES = 6
"""Frames on a plateau of 0.1 s. Source: `find_plateau`, 60 Hz."""
ONSET_N = 0.2
"""Force on the ball at the onset of a contact, which deflects it. Source: `GuardParams`, 0.15 N, and its delay."""
ALIGN_STEP_RAD = math.radians(2.5)
"""Steps in which an object turns between closing jaws until its width is smallest. Source: ours."""
ALIGN_STEPS = 4
"""Largest number of them: floor friction and the pads' edges stop larger turns. Source: ours. Closures at other heights
of the same stance turn it no further: on 39 objects in MuJoCo (`bench match --conditions realistic`, folders of
`tests/support/any_shape.py` with seeds 8001-8003), turns between them are likeliest below 1 deg."""
INSIDE_M = 0.002
"""The pads start this far inside the object's bounding sphere, so that its surface is in reach. Source: ours."""


SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class _Pressed:
    """Both pads when they press an object; left, then right.

    Attributes:
        distance_m: (2,) distance of the pads from the hand's middle.
        maps_m: (2, rows, cols) true indentation.
        poses_O_pad, shift_m: Pose of each undeformed pad in the mesh frame at which its overlap was taken, and its
            shift from there.
    """

    distance_m: Array
    maps_m: Array
    poses_O_pad: tuple[Pose, ...]
    shift_m: tuple[float, ...]

    @property
    def width_m(self) -> float:
        """Distance between the pads."""
        return float(self.distance_m.sum())


class MujocoTouchSampler(TouchSampler):
    """See `TouchSampler`.

    Raises:
        BadInput: A mesh is not usable, or the objects do not fit.
    """

    def __init__(self, description: RobotDescription, world: World, conditions: Conditions, seed: int) -> None:
        proof = AxisProof(conditions)
        truth = draw_truth(description, world, conditions, seed, proof)
        gripper = description.gripper
        self._c, self.gripper = conditions, gripper
        self._objects = {o.mesh.name: o for o in truth.objects}
        self.names = tuple(self._objects)
        self._rays = {name: SurfaceRays(o.mesh, self._roughness(o, seed)) for name, o in self._objects.items()}
        self._gel: GelSensor = gel_of_trial(gripper, conditions, seed, proof)
        self._depth = DepthErrors(conditions, seed, gripper.pad_window_m, gripper.pad_shape, proof)
        self._taxels = TaxelErrors(conditions, seed, gripper.pad_shape)
        open_ = GripperState(0.0, gripper.stroke_m, 0.0, False)
        self._imager = imager_of_trial(gripper, conditions, seed, proof)
        self._image_noise = stream(seed, "gel image noise")
        self._jaws = JawReports(conditions, seed, CLOSURE_S, open_, proof)
        self._force_gain, self._force_offset_N = force_errors(conditions, seed)
        # Compliance of the ball: lever squared over stiffness, across x_P and y_P.
        lever_m = world.probe.grasp_to_tip_m
        self._yields = [lever_m**2 / s if math.isfinite(s) else 0.0 for s in truth.probe_stiffness_Nm_rad]
        self._rng = stream(seed, "sampled contacts")
        self._fixed_m = conditions.tip_offset_sd_m * self._rng.standard_normal(2)
        self._now_s = 0.0
        self._held: dict[str, Place] = {}

    def _roughness(self, o: ObjectTruth, seed: int) -> Roughness | None:
        if self._c.object_roughness_m == 0.0:
            return None
        return Roughness(self._c.object_roughness_m, stream(seed, f"roughness {o.mesh.name}"))

    def solid(self, name: str) -> Mesh:
        """See `TouchSampler`."""
        o = self._objects[name]
        stood = _standing(o)
        return replace(o.mesh, vertices_m=stood.apply(o.mesh.vertices_m), digest=f"{o.mesh.digest} {o.lean_rad!r}")

    def probe_errors_m(self, approach: Array) -> Array:
        """See `TouchSampler`: offset and deflection of the ball, smooth position errors of the arm."""
        n = len(approach)
        arm = self._c.kinematic_error_sd_m * self._rng.standard_normal((n, 2))
        compliance = float(np.mean(self._yields))
        return np.asarray(self._fixed_m + arm + compliance * ONSET_N * approach)

    def untouched(self) -> TactileFrame:
        """See `TouchSampler`."""
        self._now_s += CLOSURE_S
        return self._frame(np.zeros((2, *self.gripper.pad_shape)))

    def untouched_images(self) -> GelImages | None:
        """See `TouchSampler`."""
        if self._imager is None:
            return None
        flat = self._imager.flat()
        return self._imager.images(self._now_s, flat, flat, self._image_noise)

    def close(
        self, name: str, place: Place, hand: Place, height_m: float, force_N: float, *, images: bool = False
    ) -> SampledClosure | None:
        """See `TouchSampler`."""
        self._now_s += CLOSURE_S
        true_N = max(self._force_gain * force_N + self._force_offset_N, 0.1)
        pressed = self._press(name, place, hand, height_m, true_N)
        steps = () if self._held.get(name) == hand else (ALIGN_STEP_RAD, -ALIGN_STEP_RAD)
        self._held[name] = hand
        for step in steps:
            for _ in range(ALIGN_STEPS):
                turned = (place[0], place[1], place[2] + step)
                tried = self._press(name, turned, hand, height_m, true_N)
                if pressed is None or tried is None or tried.width_m >= pressed.width_m - 1e-5:
                    break
                place, pressed = turned, tried
        if pressed is None or pressed.width_m > self.gripper.stroke_m:
            return None
        distance_m = pressed.distance_m
        slide_m = 0.5 * float(distance_m[1] - distance_m[0])
        y_K = np.array([math.sin(hand[2]), -math.cos(hand[2])])
        moved = (place[0] + slide_m * y_K[0], place[1] + slide_m * y_K[1], place[2])
        late = math.ceil(self._c.gripper_latency_s / CLOSURE_S) + 1
        for _ in range(late + 1):
            state = self._jaws.report(self._now_s, float(distance_m.sum()), 0.0, true_N)
        shown = self._images(pressed, name) if images else None
        return SampledClosure(state.aperture_m, self._frame(pressed.maps_m), moved, shown)

    def _images(self, pressed: _Pressed, name: str) -> GelImages | None:
        if self._imager is None:
            return None
        left, right = (
            self._imager.indentation(side, [(self._rays[name], pose)], shift_m)
            for side, pose, shift_m in zip(SIDES, pressed.poses_O_pad, pressed.shift_m, strict=True)
        )
        return self._imager.images(self._now_s, left, right, self._image_noise)

    def _press(self, name: str, place: Place, hand: Place, height_m: float, force_N: float) -> _Pressed | None:
        """Return the pads' state when they press the object, or None if a pad meets nothing."""
        rays, gel = self._rays[name], self._gel
        c, s = math.cos(hand[2]), math.sin(hand[2])
        down = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])  # columns x_P, y_P, z_P in K
        pose_K_P = Pose.from_matrix([hand[0], hand[1], height_m], down)
        pose_K_O = Pose.planar([place[0], place[1], 0.0], place[2]) @ _standing(self._objects[name])
        pose_O_P = pose_K_O.inverse() @ pose_K_P
        middle_m = float(pose_O_P.inverse().apply(rays.centre_O_m)[1])
        distances, maps, poses, shifts = [], [], [], []
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
            start_m = rays.radius_m + sign * middle_m - INSIDE_M
            pose_O_pad = pose_O_P @ pad_pose_P(side, start_m)
            overlap = gel.overlap(side, [(rays, pose_O_pad)])
            if not np.isfinite(overlap.max()):
                return None
            shift = gel.shift(overlap, force_N)
            distances.append(start_m - shift)
            maps.append(np.clip(overlap + shift, 0.0, gel.depth_m))
            poses.append(pose_O_pad)
            shifts.append(shift)
        return _Pressed(np.array(distances), np.stack(maps), tuple(poses), tuple(shifts))

    def _frame(self, maps: Array) -> TactileFrame:
        """Return the median of the frames on a plateau."""
        self._depth.feel(maps, self._now_s)
        shown = self._depth.shown(maps)
        left, right = np.median([self._taxels.spoil(shown) for _ in range(FRAMES)], axis=0)
        return TactileFrame(self._now_s, left, right)


def _standing(o: ObjectTruth) -> Pose:
    """Return the pose in which an object leans on its uneven base, its lowest point on the floor."""
    about = np.array([-math.sin(o.lean_about_rad), math.cos(o.lean_about_rad), 0.0])
    lean = rotation_vector(o.lean_rad * about)
    lowest = float(lean.apply(o.mesh.vertices_m)[:, 2].min())
    return Pose(np.array([0.0, 0.0, -lowest])) @ lean
