"""The passive probe and its stand.

The stand is a block with a slot. Two rails on its top carry the handle, and the shaft hangs through the slot. The rails
lie inside the handle's outline, so that closed fingers pass them; the slot is wider than the ball.
"""

from __future__ import annotations

import math
from itertools import product

import mujoco
import numpy as np

from glotouch_backends.mujoco.model.contact import (
    ENVIRONMENT,
    GEL_TORSION_M,
    GROUP_COLLISION,
    HANDLE,
    HOLDER_FRICTION,
    PAD_HANDLE,
    PAD_HANDLE_FRICTION,
    PROBE,
    ROLLING_M,
    TIP_FRICTION,
    set_category,
    set_friction,
)
from glotouch_backends.mujoco.truth import Truth
from glotouch_bt.robot import Holder, ParamError, Probe
from glotouch_bt.robot.scene import Mesh

RAIL_HEIGHT_M = 0.003
"""Height of the rails. Source: ours."""
MIN_BALL_CLEARANCE_M = 0.001
"""Smallest gap between ball and rail on each side. Source: ours."""
LEDGE_M = 0.0015
"""Overlap of a rail with the handle. Source: ours."""
RIDGE_RADIUS_M = 0.002
"""Radius of the ridges that the pads hold. Source: ours."""
RIDGE_SHARE = 0.85
"""Length of a ridge between the centres of its ends, over the handle's. Source: ours; both ends lie on a pad of 28.5 mm
whose middle is within 0.6 mm of the handle's. Farther off, the pad's edge meets the ridge."""
MAX_SHAFT_STIFFNESS_NM_RAD = 170.0
"""Largest stiffness between handle and shaft, or 1 ms steps become unstable; 0.1 mm/N at the ball. Source: ours."""
GEL_DAMPING_RATIO = 0.5
"""Damping ratio of the shaft in the gel. Source: ours; silicone gels damp strongly."""
_BOX_FACES = (
    (1, 3, 0), (4, 1, 0), (0, 3, 2), (2, 4, 0), (1, 7, 3), (5, 1, 4),
    (5, 7, 1), (3, 7, 2), (6, 4, 2), (2, 7, 6), (6, 5, 4), (7, 5, 6),
)  # fmt: skip
"""Faces of a box whose corners are in the order of `itertools.product`; those of `trimesh.creation.box`."""
HANDLE_COLOUR, STEEL_COLOUR, STAND_COLOUR = (0.15, 0.35, 0.65, 1.0), (0.75, 0.77, 0.80, 1.0), (0.3, 0.32, 0.3, 1.0)


def handle_mesh(probe: Probe) -> Mesh:
    """Return the handle as a solid in the probe's body frame; the pads sense it while they hold the probe."""
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * probe.handle_m
    return Mesh("handle", corners, np.array(_BOX_FACES), f"handle {probe.handle_m}")


def _compliant(body: mujoco.MjsBody, probe: Probe, truth: Truth) -> mujoco.MjsBody:
    """Return the body of the shaft: `probe` itself if it is rigid, else a body that turns in the handle's centre.

    The gel's shear layer and the fingers carry the handle; springs between handle and shaft stand for them. The
    handle's frame is that of the jaws: they close along y, so a rotation about y is a rotation about their axis.
    """
    stiffness = truth.probe_stiffness_Nm_rad
    if all(map(math.isinf, stiffness)):
        return body
    # The shaft is a uniform rod, and the handle is as heavy as the probe's centre of mass says. The handle keeps the
    # inertia of the whole probe: with its own, 4e-6 kg m2, the springs are too stiff for steps of 1 ms.
    middle_m = 0.5 * (probe.handle_m[2] + probe.length_m)
    mass = probe.mass_kg * probe.com_below_grasp_m / middle_m
    body.mass, body.ipos = probe.mass_kg - mass, np.zeros(3)
    shaft = body.add_body(name="shaft", mass=mass, explicitinertial=True)
    shaft.ipos = truth.pose_handle_shaft.apply((0.0, 0.0, middle_m))
    rod = mass * probe.length_m**2 / 12.0
    shaft.inertia = (rod, rod, 0.5 * mass * (0.5 * probe.shaft_diameter_m) ** 2)
    inertia = rod + mass * middle_m**2  # about the hinges
    for name, axis, k in zip("xy", ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), stiffness, strict=True):
        if math.isfinite(k):
            k = min(k, MAX_SHAFT_STIFFNESS_NM_RAD)
            joint = shaft.add_joint(name=f"shaft_{name}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
            damping = 2.0 * GEL_DAMPING_RATIO * math.sqrt(k * inertia)
            joint.stiffness, joint.damping = (k, 0.0, 0.0), (damping, 0.0, 0.0)  # linear, of cubic polynomials
    return shaft


def add_probe(spec: mujoco.MjSpec, probe: Probe, holder: Holder, truth: Truth) -> None:
    """Add the stand and, standing in it, the free body `probe` (frame: handle's centre, z to the tip).

    Its geoms are `handle`, `shaft`, `ball`, and a ridge along z flush with each face that the pads hold: a pad has two
    contacts with a ridge. With a face it has four, which cost the solver much more. The site `tip` is the centre of
    the ball.
    """
    pose_handle_shaft, pad_friction = truth.pose_handle_shaft, truth.pad_friction
    pose = holder.pose_B_grasp
    body = spec.worldbody.add_body(name="probe", pos=pose.position_m, quat=pose.quat)
    body.add_freejoint(name="probe")
    hx, hy, hz = (0.5 * s for s in probe.handle_m)
    handle = body.add_geom(name="handle", type=mujoco.mjtGeom.mjGEOM_BOX, size=(hx, hy, hz), rgba=HANDLE_COLOUR)
    set_category(handle, HANDLE)
    set_friction(handle, HOLDER_FRICTION, priority=1)

    body.explicitinertial = True
    body.mass = probe.mass_kg
    body.ipos = pose_handle_shaft.apply((0.0, 0.0, probe.com_below_grasp_m))
    # Inertia of a uniform rod of the whole length, as thick as the handle; the true mass distribution is not described.
    whole = probe.handle_m[2] + probe.length_m
    across = probe.mass_kg * (whole**2 + probe.handle_m[0] ** 2) / 12
    body.inertia = (across, across, probe.mass_kg * (probe.handle_m[0] ** 2 + probe.handle_m[1] ** 2) / 12)

    top, ball = pose_handle_shaft.apply([(0.0, 0.0, hz), (0.0, 0.0, probe.grasp_to_tip_m)])
    lower = _compliant(body, probe, truth)
    shaft = lower.add_geom(name="shaft", type=mujoco.mjtGeom.mjGEOM_CYLINDER, rgba=STEEL_COLOUR)
    shaft.fromto = (*top, *ball)
    shaft.size = (0.5 * probe.shaft_diameter_m, 0.0, 0.0)
    tip = lower.add_geom(
        name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=ball, size=(probe.tip_radius_m, 0.0, 0.0), rgba=STEEL_COLOUR
    )
    for geom in (shaft, tip):
        set_category(geom, PROBE)
        set_friction(geom, TIP_FRICTION, priority=1)
    lower.add_site(name="tip", pos=ball, quat=pose_handle_shaft.quat)

    for side, face in ((1.0, "left"), (-1.0, "right")):
        ridge = body.add_geom(
            name=f"ridge_{face}",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            pos=(0.0, side * (hy - RIDGE_RADIUS_M), 0.0),
            size=(RIDGE_RADIUS_M, RIDGE_SHARE * hz, 0.0),
            contype=0,
            conaffinity=0,
            group=GROUP_COLLISION,
        )
        for pad in ("pad_left", "pad_right"):  # the hand holds the handle either way round
            pair = spec.add_pair(name=f"{pad}_{face}", geomname1=pad, geomname2=ridge.name, condim=4)
            pair.friction = (pad_friction, pad_friction, GEL_TORSION_M, ROLLING_M, ROLLING_M)
            pair.solref = PAD_HANDLE
            pair.solreffriction = PAD_HANDLE_FRICTION
    _add_stand(spec, probe, holder)


def _add_stand(spec: mujoco.MjSpec, probe: Probe, holder: Holder) -> None:
    hx, hy, hz = (0.5 * s for s in probe.handle_m)
    bx, by, bz = holder.half_m
    gap = hx - LEDGE_M  # half width of the slot
    if gap < probe.tip_radius_m + MIN_BALL_CLEARANCE_M:
        min_mm = 2e3 * (probe.tip_radius_m + MIN_BALL_CLEARANCE_M + LEDGE_M)
        raise ParamError(
            "probe.handle_m[0]", probe.handle_m[0], f">= {min_mm:.0f} mm, or the ball does not fit through the stand"
        )
    if bx <= hx or by <= hy:
        raise ParamError("holder.half_m", holder.half_m, "larger than the probe's handle")
    pose = holder.pose_B_grasp
    stand = spec.worldbody.add_body(name="holder", pos=pose.position_m, quat=pose.quat)
    block = hz + RAIL_HEIGHT_M + bz
    slot_y = by - 0.004
    across = 0.5 * (bx - gap)
    boxes = [((s * (gap + across), 0.0, block), (across, by, bz)) for s in (-1.0, 1.0)]
    boxes += [((0.0, s * (by - 0.002), block), (gap, 0.002, bz)) for s in (-1.0, 1.0)]
    # The rails end inside the handle's outline: the fingers close beside them.
    rail_x, rail_y = 0.5 * LEDGE_M, min(hy - 0.001, slot_y)
    boxes += [
        ((s * (gap + rail_x), 0.0, hz + 0.5 * RAIL_HEIGHT_M), (rail_x, rail_y, 0.5 * RAIL_HEIGHT_M))
        for s in (-1.0, 1.0)
    ]
    for centre, half in boxes:
        geom = stand.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=np.array(centre), size=half, rgba=STAND_COLOUR)
        set_category(geom, ENVIRONMENT)
        set_friction(geom, HOLDER_FRICTION)
