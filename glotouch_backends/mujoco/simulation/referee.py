"""Ground truth of the simulated world, for scoring only."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.sensing import body_pose
from glotouch_backends.mujoco.simulation.control_trace import ControlTrace
from glotouch_backends.mujoco.simulation.disturber import Disturbed
from glotouch_backends.mujoco.simulation.true_force import TrueForce
from glotouch_bt.robot import Array, Pose
from glotouch_bt.robot.simulation import BareSteps, TrueObject

MAX_STOWED_OFFSET_M = 0.005
"""The probe is stowed if its handle is within this distance of its place in the stand. Source: ours."""
MIN_STOWED_COSINE = 0.996
"""... and tilted by less than 5 degrees (cosine). Source: ours."""


class Simulated(Disturbed, Protocol):
    """The parts of a simulated robot that its referee reads."""

    true_force: TrueForce
    proof: AxisProof
    trace: ControlTrace | None


class MujocoReferee:
    """See `robot.simulation.Referee`."""

    def __init__(self, robot: Simulated) -> None:
        self._robot = robot

    def objects(self) -> list[TrueObject]:
        """See `Referee`; in the world's order."""
        r = self._robot
        _, *fingers = range(r.handles.hand_bodies.start, r.handles.hand_bodies.stop)
        result = []
        for body, item in zip(r.handles.object_bodies, r.truth.objects, strict=True):
            pose = body_pose(r.data, body)
            seen = pose.apply(item.mesh.vertices_m)[:, :2]
            held = all(self._on(body, f) for f in fingers) and not self._on(body, r.handles.container_body)
            outline = seen[scipy.spatial.ConvexHull(seen).vertices]
            result.append(TrueObject(item.mesh.name, pose, item.mass_kg, outline, held, np.array(item.mesh.extents_m)))
        return result

    def pose_B_K(self) -> Pose:
        """See `Referee`."""
        return self._robot.truth.pose_B_K

    def tip_B_m(self) -> Array:
        """See `Referee`."""
        return np.array(self._robot.data.site_xpos[self._robot.handles.tip_site])

    def push_tip(self, force_B_N: Array) -> None:
        """See `Referee`."""
        r, body = self._robot, self._robot.handles.tip_body
        lever = self.tip_B_m() - r.data.xipos[body]
        r.data.xfrc_applied[body] = np.concatenate([force_B_N, np.cross(lever, force_B_N)])

    def probe_in_holder(self) -> bool:
        """Return True if the handle is at its place, upright, and the hand does not touch the probe."""
        r = self._robot
        stowed = r.world.holder.pose_B_grasp
        now = body_pose(r.data, r.handles.probe_body)
        near = float(np.linalg.norm(now.position_m - stowed.position_m)) < MAX_STOWED_OFFSET_M
        upright = float(now.rotation[:, 2] @ stowed.rotation[:, 2]) > MIN_STOWED_COSINE
        hand = r.handles.hand_bodies
        return near and upright and not any(self._on(r.handles.probe_body, b) for b in range(hand.start, hand.stop))

    def peak_force_N(self) -> float:
        """See `Referee`."""
        return self._robot.true_force.peak_N

    def samples_over_limit(self) -> int:
        """See `Referee`."""
        return self._robot.true_force.samples_over

    def contact_softness_s(self) -> float:
        """See `Referee`."""
        return self._robot.truth.contact_s

    def silent_axes(self) -> tuple[str, ...]:
        """See `Referee`."""
        return self._robot.proof.silent()

    def replay_bare_steps(self) -> BareSteps | None:
        """See `Referee`."""
        trace = self._robot.trace
        return None if trace is None else trace.replay(self._robot.data)

    def _on(self, body: int, other: int) -> bool:
        """Return True if two bodies are in contact."""
        r = self._robot
        bodies = r.model.geom_bodyid[np.asarray(r.data.contact.geom).reshape(-1, 2)]
        return bool(((bodies == (body, other)).all(axis=1) | (bodies == (other, body)).all(axis=1)).any())
