"""Model of the tactile sensors: contacts on the pads, depth maps from the gel model, and their delayed frames.

Only forces on the pads' own geoms count: an object on a finger's back leaves the gel untouched.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.model import BuiltWorld, Handles, handle_mesh
from glotouch_backends.mujoco.printed import Roughness
from glotouch_backends.mujoco.sensing.depth import DepthErrors
from glotouch_backends.mujoco.sensing.gel import BOTTOM_M, STIFFNESS_N_MM3, GelSensor, PairPress, pad_poses_P
from glotouch_backends.mujoco.sensing.image import GelImager
from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_bt.robot import Array, Conditions, GelImages, Gripper, Pose, TactileFrame
from glotouch_bt.robot.scene import stream

Surfaces = list[tuple[SurfaceRays, Pose]]
"""Each object's rays, and the pose of a pad in its mesh frame."""
MAX_SAME_TRAVEL_M = 1e-5
"""Do not solve the gel again while the jaws have moved less than this. Source: ours."""
MAX_SAME_FORCE_N = 0.5
"""Do not solve the gel again while the jaws' forces have changed less than this. Source: ours."""


def gel_of_trial(
    gripper: Gripper, conditions: Conditions, seed: int, proof: AxisProof, shape: tuple[int, int] | None = None
) -> GelSensor:
    """Return the gel of both pads, with the stiffness and thickness of the trial.

    `shape` (rows, cols) is that of the maps by default.
    """
    c, rng = conditions, stream(seed, "gel material")
    stiffer, thicker = float(rng.uniform(*c.gel_stiffness_factor)), float(rng.uniform(*c.gel_thickness_factor))
    proof.saw("gel_stiffness_factor", 1.0, stiffer)
    proof.saw("gel_thickness_factor", 1.0, thicker)
    # A Winkler modulus is the confined modulus over the thickness.
    stiffness, bottom = STIFFNESS_N_MM3 * stiffer / thicker, BOTTOM_M * thicker
    shape = shape or gripper.pad_shape
    return GelSensor(gripper.pad_window_m, shape, gripper.pad_depth_m, stiffness, bottom_m=bottom)


def imager_of_trial(gripper: Gripper, conditions: Conditions, seed: int, proof: AxisProof) -> GelImager | None:
    """Return the cameras of both pads with the errors of the trial, or None if the gripper has none."""
    camera = gripper.camera
    if camera is None:
        return None
    return GelImager(camera, gel_of_trial(gripper, conditions, seed, proof, camera.shape), conditions, seed, proof)


class TaxelErrors:
    """Errors of single taxels: constant offsets, white noise, dead ones.

    Args:
        conditions, seed: Sizes of the errors, and the source of their draws.
        shape: (rows, cols) of a map.
    """

    def __init__(self, conditions: Conditions, seed: int, shape: tuple[int, int]) -> None:
        self._noise_m, self._rng = conditions.tactile_noise_sd_m, stream(seed, "tactile")
        fixed = stream(seed, "gel")
        self._offset = fixed.uniform(*conditions.tactile_offset_m, (2, *shape))
        self._dead = fixed.random((2, *shape)) < conditions.tactile_dead_fraction

    def spoil(self, maps_m: Array) -> Array:
        """Return the maps (2, rows, cols) with these errors; NaN for a dead taxel."""
        if self._noise_m > 0.0:
            maps_m = maps_m + self._noise_m * self._rng.standard_normal(maps_m.shape)
        maps_m = maps_m + self._offset
        maps_m[self._dead] = np.nan
        return maps_m


def body_pose(data: mujoco.MjData, body: int) -> Pose:
    """Return the true pose of a body in B."""
    return Pose(data.xpos[body], data.xquat[body])


class PadContacts:
    """Contacts on the two pads at the present solver step."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, handles: Handles) -> None:
        self._data, self._geoms = data, handles.pad_geoms
        self._axes = data.site_xmat[handles.pads_site]
        self._body_of = model.geom_bodyid
        self._force_B: Array = np.zeros((0, 3))
        self._on_left: npt.NDArray[np.bool_] = np.zeros(0, dtype=bool)

    def touch(self) -> tuple[tuple[float, float], set[int]]:
        """Return the normal force on the (left, right) pad, N, and the bodies that touch them.

        The first three constraint rows of an elliptic contact are its force on the second geom, in the contact's frame.
        """
        contact = self._data.contact
        pairs, address = contact.geom, contact.efc_address
        left, right = self._geoms
        self._force_B = np.zeros((0, 3))
        if len(pairs) == 0:
            return (0.0, 0.0), set()
        mine = np.flatnonzero(((pairs == left) | (pairs == right)).any(axis=1) & (address >= 0))
        if len(mine) == 0:
            return (0.0, 0.0), set()
        pairs = pairs[mine]
        pad_second = (pairs[:, 1] == left) | (pairs[:, 1] == right)
        rows = self._data.efc_force[address[mine][:, None] + np.arange(3)]
        force_B = np.einsum("ni,nij->nj", rows, contact.frame[mine].reshape(-1, 3, 3))
        force_B[~pad_second] *= -1.0  # force on the pad
        along = force_B @ self._axes[1::3]  # on y_P
        on_left = np.where(pad_second, pairs[:, 1], pairs[:, 0]) == left
        other = np.where(pad_second, pairs[:, 0], pairs[:, 1])[rows[:, 0] > 0.0]
        self._force_B, self._on_left = force_B, on_left
        forces = (max(float(along[on_left].sum()), 0.0), max(-float(along[~on_left].sum()), 0.0))
        return forces, set(self._body_of[other].tolist())

    def tangential_N(self) -> Array:
        """Return the tangential forces (2, 2) of the last `touch`: left and right pad, along x_P and z_P."""
        if len(self._force_B) == 0:
            return np.zeros((2, 2))
        aside = self._force_B @ self._axes.reshape(3, 3)[:, [0, 2]]
        return np.stack([aside[self._on_left].sum(axis=0), aside[~self._on_left].sum(axis=0)])


class Tactile:
    """Sample the pads at the tactile rate; deliver frames late, with noise and dead taxels.

    Attributes:
        shift_m: Sum of both pads' gel shifts at the last sample: the additional closing of jaws with a soft gel; part
            of the reported aperture.
        depth: Errors of the depth maps.
        taxels: Errors of single taxels.
    """

    def __init__(self, built: BuiltWorld) -> None:
        handles, gripper, conditions = built.handles, built.description.gripper, built.conditions
        self._data = built.data
        self._pads = PadContacts(built.model, built.data, handles)
        self._site = handles.pads_site
        self._gel = gel_of_trial(gripper, conditions, built.seed, built.proof)
        self.depth = DepthErrors(conditions, built.seed, gripper.pad_window_m, gripper.pad_shape, built.proof)
        self._proof, self._seed = built.proof, built.seed
        self._jitter = stream(built.seed, "frame jitter")
        self._meshes = dict(zip(handles.object_bodies, (o.mesh for o in built.truth.objects), strict=True))
        self._meshes[handles.probe_body] = handle_mesh(built.world.probe)
        self._smooth = handles.probe_body
        self._rays: dict[int, SurfaceRays] = {}
        self._c = conditions
        self.taxels = TaxelErrors(conditions, built.seed, gripper.pad_shape)
        self._frames: deque[tuple[float, TactileFrame]] = deque()
        self._tick = -1
        self._solved = (np.inf, np.inf, 0.0, 0.0)
        self._press: PairPress | None = None
        self._imager = imager_of_trial(gripper, conditions, built.seed, built.proof)
        self._image_noise = stream(built.seed, "gel image noise")
        self._images: deque[tuple[float, GelImages]] = deque()
        self._image_due = False
        self._zero = np.zeros(gripper.pad_shape)
        self.shift_m = 0.0

    def sample(
        self, now_s: float, wanted: bool, jaws: Sequence[float], jaw_forces: Sequence[float], images: bool = False
    ) -> None:
        """Take a frame if one is due. Call once a period, after its last step.

        Args:
            now_s: Robot clock.
            wanted: True if frames are requested; else the gel is solved again only when jaws or forces have changed.
            jaws, jaw_forces: (left, right) present travel m and servo force N.
            images: Take one pair of gel images with the next frame.
        """
        self._image_due |= images and self._imager is not None
        tick = int(now_s * self._c.tactile_rate_Hz + 1e-6)
        if tick == self._tick:
            return
        self._tick = tick
        if not (wanted or self._image_due) and self._unchanged(jaws, jaw_forces):
            return
        self._solved = (jaws[0], jaws[1], jaw_forces[0], jaw_forces[1])
        forces, bodies = self._pads.touch()
        pads: tuple[Surfaces, Surfaces] = [], []
        if bodies:
            pads = self._solve(forces, bodies, (jaws[0], jaws[1]))
        else:
            self._press, self.shift_m = None, 0.0
        maps = self._true_maps()
        self.depth.feel(maps, now_s)
        if not (wanted or self._image_due):
            return
        late_s = self._c.tactile_latency_s
        if self._c.latency_jitter_s > 0.0:
            late_s = max(0.0, late_s + self._c.latency_jitter_s * float(self._jitter.uniform(-1.0, 1.0)))
        if wanted:
            self._frames.append((now_s + late_s, self._frame(now_s, maps)))
        if self._image_due and self._imager is not None:
            self._images.append((now_s + late_s, self._image(self._imager, now_s, pads)))
            self._image_due = False

    def _unchanged(self, jaws: Sequence[float], jaw_forces: Sequence[float]) -> bool:
        left, right, left_N, right_N = self._solved
        return (
            abs(jaws[0] - left) + abs(jaws[1] - right) < MAX_SAME_TRAVEL_M
            and abs(jaw_forces[0] - left_N) + abs(jaw_forces[1] - right_N) < MAX_SAME_FORCE_N
        )

    def arrived(self, now_s: float, wanted: bool) -> TactileFrame | None:
        """Return the newest frame that has arrived since the last call, if requested."""
        newest = None
        while self._frames and self._frames[0][0] <= now_s + 1e-9:
            newest = self._frames.popleft()[1]
        return newest if wanted else None

    def arrived_images(self, now_s: float) -> GelImages | None:
        """Return the newest pair of images that has arrived since the last call."""
        newest = None
        while self._images and self._images[0][0] <= now_s + 1e-9:
            newest = self._images.popleft()[1]
        return newest

    def _image(self, imager: GelImager, now_s: float, pads: tuple[Surfaces, Surfaces]) -> GelImages:
        """Return the images of what the pads press into; a pad without a force on it is flat."""
        p, left_m, right_m = self._press, imager.flat(), imager.flat()
        if p is not None and p.left_m.any():
            left_m = imager.indentation("left", pads[0], p.left_shift_m)
        if p is not None and p.right_m.any():
            right_m = imager.indentation("right", pads[1], p.right_shift_m)
        return imager.images(now_s, left_m, right_m, self._image_noise)

    def _solve(
        self, forces: tuple[float, float], bodies: set[int], jaws: tuple[float, float]
    ) -> tuple[Surfaces, Surfaces]:
        """Press the pads against the bodies; return the surfaces in front of the left and the right pad."""
        data = self._data
        pose_B_P = Pose.from_matrix(data.site_xpos[self._site], data.site_xmat[self._site].reshape(3, 3))
        surfaces: Surfaces = []
        for body in sorted(bodies & self._meshes.keys()):
            if body not in self._rays:
                self._rays[body] = SurfaceRays(self._meshes[body], self._roughness(body))
            surfaces.append((self._rays[body], body_pose(data, body).inverse() @ pose_B_P))
        shear = None
        if self._c.tactile_shear_m_per_N > 0.0:
            shear = self._c.tactile_shear_m_per_N * self._pads.tangential_N()
            self._proof.saw("tactile_shear_m_per_N", 0.0, shear)
        self._press = self._gel.press_pair(surfaces, jaws, forces, shear)
        self.shift_m = self._press.left_shift_m + self._press.right_shift_m
        left_P, right_P = pad_poses_P(jaws, shear)
        return [(r, p @ left_P) for r, p in surfaces], [(r, p @ right_P) for r, p in surfaces]

    def _roughness(self, body: int) -> Roughness | None:
        """Return the roughness of an object; the probe's handle is smooth."""
        mesh = self._meshes[body]
        if self._c.object_roughness_m == 0.0 or body == self._smooth:
            return None
        found = Roughness(self._c.object_roughness_m, stream(self._seed, f"roughness {mesh.name}"))
        self._proof.saw("object_roughness_m", 0.0, found.at(mesh.vertices_m[:1]))
        return found

    def _true_maps(self) -> Array:
        """Return the true indentation (2, rows, cols) of the last sample."""
        p = self._press
        return np.stack([self._zero, self._zero] if p is None else [p.left_m, p.right_m])

    def _frame(self, stamp_s: float, maps: Array) -> TactileFrame:
        maps = self.taxels.spoil(self.depth.shown(maps))
        return TactileFrame(stamp_s, maps[0], maps[1])
