"""The gel pads in the loop: which objects press on them, how hard, and the frames that arrive.

Only forces on the pads' own geoms count: a finger's back that carries the object leaves the gel untouched.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import mujoco
import numpy as np

from backends.mujoco.gel import GelSensor, PairPress
from backends.mujoco.model import Handles
from backends.mujoco.rays import SurfaceRays
from backends.mujoco.streams import stream
from glotouch_bt.robot import Array, Conditions, Gripper, Pose, TactileFrame
from glotouch_bt.robot.meshes import Mesh

SAME_DISTANCE_M = 1e-5  # the gel is not solved again while pads and forces stay this near the last solution
SAME_FORCE = 0.02


def body_pose(data: mujoco.MjData, body: int) -> Pose:
    """True pose of a body in B."""
    return Pose(data.xpos[body], data.xquat[body])


class Pads:
    """Contacts on the two pads, read from the solver at the present step."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, handles: Handles) -> None:
        self._model, self._data, self._geoms = model, data, handles.pad_geoms
        self._site = handles.pads_site
        self._body_of = model.geom_bodyid
        self._row = np.zeros(6)

    def touch(self) -> tuple[tuple[float, float], set[int]]:
        """Normal force on (left, right) pad, N, and the bodies that press on them."""
        data = self._data
        pairs = data.contact.geom
        forces, bodies = [0.0, 0.0], set()
        if len(pairs) == 0:
            return (0.0, 0.0), bodies
        for side, pad in enumerate(self._geoms):
            closing = data.site_xmat[self._site].reshape(3, 3)[:, 1] * (1.0 if side == 0 else -1.0)
            for i in np.flatnonzero((pairs == pad).any(axis=1)):
                contact = data.contact[int(i)]
                mujoco.mj_contactForce(self._model, data, int(i), self._row)
                if self._row[0] <= 0.0:
                    continue
                on_second = self._row[:3] @ contact.frame.reshape(3, 3)  # force of geom 1 on geom 2, in B
                first, second = int(contact.geom[0]), int(contact.geom[1])
                push = on_second if second == pad else -on_second
                forces[side] += float(push @ closing)  # outwards: what presses the gel into its finger
                bodies.add(int(self._body_of[first if second == pad else second]))
        return (max(forces[0], 0.0), max(forces[1], 0.0)), bodies


class Tactile:
    """Samples the pads at the tactile rate; delivers frames late, noisy, with dead taxels.

    Attributes:
        shift_m: Sum of both pads' gel shifts at the last sample: how much further the jaws of a soft gel would have
            closed than the simulated ones; part of the reported aperture.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        handles: Handles,
        gripper: Gripper,
        surfaces: Sequence[tuple[int, Mesh]],
        conditions: Conditions,
        seed: int,
    ) -> None:
        self._data = data
        self._pads = Pads(model, data, handles)
        self._jaws, self._site = handles.jaw_qpos, handles.pads_site
        self._gel = GelSensor(gripper.pad_window_m, gripper.pad_shape, gripper.pad_depth_m)
        self._meshes = dict(surfaces)
        self._rays: dict[int, SurfaceRays] = {}
        self._c = conditions
        self._rng = stream(seed, "tactile")
        fixed = stream(seed, "gel")
        shape = (2, *gripper.pad_shape)
        self._offset = fixed.uniform(*conditions.tactile_offset_m, shape)
        self._dead = fixed.random(shape) < conditions.tactile_dead_fraction
        self._frames: deque[tuple[float, TactileFrame]] = deque()
        self._tick = -1
        self._solved: tuple[tuple[int, ...], Array] | None = None
        self._press: PairPress | None = None
        self._zero = np.zeros(gripper.pad_shape)
        self.shift_m = 0.0

    def sample(self, now_s: float, wanted: bool) -> None:
        """Called once a period, after its last step: take a frame if one is due."""
        tick = int(now_s * self._c.tactile_rate_Hz + 1e-6)
        if tick == self._tick:
            return
        self._tick = tick
        forces, bodies = self._pads.touch()
        if bodies:
            self._solve(forces, bodies, wanted)
        else:
            self._solved, self._press, self.shift_m = None, None, 0.0
        if wanted:
            self._frames.append((now_s + self._c.tactile_latency_s, self._frame(now_s)))

    def arrived(self, now_s: float, wanted: bool) -> TactileFrame | None:
        """The newest frame that has arrived since the last call, if asked for."""
        newest = None
        while self._frames and self._frames[0][0] <= now_s + 1e-9:
            newest = self._frames.popleft()[1]
        return newest if wanted else None

    def _solve(self, forces: tuple[float, float], bodies: set[int], wanted: bool) -> None:
        data = self._data
        jaws = data.qpos[self._jaws]
        key = tuple(sorted(bodies))
        now = np.array([*jaws / SAME_DISTANCE_M, *np.log(np.maximum(forces, 1e-3)) / SAME_FORCE])
        if self._solved is not None and not wanted:
            before, then = self._solved
            if before == key and np.abs(now - then).max() < 1.0:
                return
        self._solved = (key, now)
        pose_B_P = Pose.from_matrix(data.site_xpos[self._site], data.site_xmat[self._site].reshape(3, 3))
        surfaces = []
        for body in key:
            if body in self._meshes:
                if body not in self._rays:
                    self._rays[body] = SurfaceRays(self._meshes[body])
                surfaces.append((self._rays[body], body_pose(data, body).inverse() @ pose_B_P))
        self._press = self._gel.press_pair(surfaces, (float(jaws[0]), float(jaws[1])), forces)
        self.shift_m = self._press.left_shift_m + self._press.right_shift_m

    def _frame(self, stamp_s: float) -> TactileFrame:
        p = self._press
        maps = np.stack([self._zero, self._zero] if p is None else [p.left_m, p.right_m])
        if self._c.tactile_noise_sd_m > 0.0:
            maps += self._c.tactile_noise_sd_m * self._rng.standard_normal(maps.shape)
        maps += self._offset
        maps[self._dead] = np.nan
        return TactileFrame(stamp_s, maps[0], maps[1])
