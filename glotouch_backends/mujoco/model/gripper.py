"""The parallel gripper: a housing and two coupled sliding fingers, each with a gel pad.

The pads protrude by PAD_PROUD_M from the fingers, so that a flat object touches the gel and not the finger.
"""

from __future__ import annotations

import mujoco
import numpy as np

from glotouch_backends.mujoco.model.contact import (
    GEL,
    GEL_TORSION_M,
    HAND,
    HAND_FRICTION,
    PAD,
    PAD_IMPEDANCE,
    set_category,
    set_friction,
)
from glotouch_bt.robot import Box, Gripper

PAD_PROUD_M = 0.002
"""Height of the pads above the fingers. Source: ours."""
JAW_STIFFNESS_N_M = 8000.0
"""Stiffness of a jaw's servo. Source: ours."""
JAW_DAMPING_NS_M = 150.0
"""Damping of a jaw's servo. Source: ours."""
JAW_ARMATURE_KG = 0.16
"""Inertia of motor and gear as seen at the jaw. Source: ours."""
COUPLING = (0.004, 1.0)
"""Time constant s and damping ratio of the coupling between the jaws. Source: ours."""
HAND_COLOUR, FINGER_COLOUR, PAD_COLOUR = (0.25, 0.27, 0.30, 1.0), (0.45, 0.47, 0.5, 1.0), (0.95, 0.55, 0.2, 1.0)


def box_inertia(mass_kg: float, half_m: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the principal moments of a uniform box about its centre, kg m2."""
    x, y, z = (h * h for h in half_m)
    return mass_kg / 3 * (y + z), mass_kg / 3 * (x + z), mass_kg / 3 * (x + y)


def _box(
    body: mujoco.MjsBody, box: Box, colour: tuple[float, ...], name: str = "", category: int = HAND
) -> mujoco.MjsGeom:
    geom = body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=box.centre_m, size=box.half_m, rgba=colour, mass=0.0
    )
    set_category(geom, category)
    set_friction(geom, HAND_FRICTION)
    return geom


def finger_boxes(gripper: Gripper, side: float) -> tuple[Box, Box]:
    """Return finger and pad of the left (+1) or right (-1) side, in P with the jaws closed."""
    (x, y, z), (hx, hy, hz) = gripper.finger.centre_m, gripper.finger.half_m
    back = Box(centre_m=(x, side * (y + 0.5 * PAD_PROUD_M), z), half_m=(hx, hy - 0.5 * PAD_PROUD_M, hz))
    width, length = gripper.pad_window_m
    pad = Box(centre_m=(0.0, side * PAD_PROUD_M, 0.0), half_m=(0.5 * width, PAD_PROUD_M, 0.5 * length))
    return back, pad


def add_gripper(spec: mujoco.MjSpec, hand: mujoco.MjsBody, gripper: Gripper, pad_friction: float) -> None:
    """Fill the flange body `hand` with the gripper: sites S and P, jaws `jaw_left`, `jaw_right`, geoms `pad_*`."""
    hand.explicitinertial = True
    hand.mass = gripper.mass_kg
    hand.ipos = gripper.com_E_m
    low = np.min([np.subtract(b.centre_m, b.half_m) for b in gripper.body], axis=0)
    high = np.max([np.add(b.centre_m, b.half_m) for b in gripper.body], axis=0)
    hand.inertia = box_inertia(gripper.mass_kg, tuple(0.5 * (high - low)))
    hand.gravcomp = 1.0
    for box in gripper.body:
        _box(hand, box, HAND_COLOUR)
    hand.add_site(name="S")
    hand.add_site(name="P", pos=gripper.pose_E_P.position_m, quat=gripper.pose_E_P.quat)
    for name, side in (("left", 1.0), ("right", -1.0)):
        back, pad = finger_boxes(gripper, side)
        finger = hand.add_body(
            name=f"finger_{name}", pos=gripper.pose_E_P.position_m, quat=gripper.pose_E_P.quat, gravcomp=1.0
        )
        finger.explicitinertial = True
        finger.mass = gripper.finger_mass_kg
        finger.ipos = back.centre_m
        finger.inertia = box_inertia(gripper.finger_mass_kg, gripper.finger.half_m)
        finger.add_joint(
            name=f"jaw_{name}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=(0.0, side, 0.0),
            range=(0.0, 0.5 * gripper.stroke_m),
            limited=True,
            armature=JAW_ARMATURE_KG,
        )
        _box(finger, back, FINGER_COLOUR)
        gel = _box(finger, pad, PAD_COLOUR, f"pad_{name}", GEL)
        gel.solref, gel.solimp[:3] = PAD, PAD_IMPEDANCE
        set_friction(gel, pad_friction, priority=2, torsion_m=GEL_TORSION_M)
        motor = spec.add_actuator(name=f"jaw_{name}", target=f"jaw_{name}", trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_position(kp=JAW_STIFFNESS_N_M, kv=JAW_DAMPING_NS_M)
        motor.forcelimited = True
        motor.forcerange = (-gripper.force_N, gripper.force_N)
    gear = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name="jaws", name1="jaw_left", name2="jaw_right")
    gear.objtype = mujoco.mjtObj.mjOBJ_JOINT
    gear.data = [0.0, 1.0, *([0.0] * 10)]
    gear.solref = COUPLING
    spec.add_exclude(bodyname1="finger_left", bodyname2="finger_right")
