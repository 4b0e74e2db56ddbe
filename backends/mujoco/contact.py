"""Who touches whom, and how stiff and rough contacts are.

Friction creep is the trap of rigid-body contact: with a pyramidal cone or a small impratio, objects turn and slide
under loads that friction should hold. The options here (elliptic cone, large impratio, noslip iterations) hold them still.
"""

from __future__ import annotations

import mujoco

# Categories: a geom has one category (contype) and collides with the categories in its affinity.
ENVIRONMENT, OBJECT, HAND, PROBE = 1, 2, 4, 8
AFFINITY = {
    ENVIRONMENT: OBJECT | HAND | PROBE,
    OBJECT: ENVIRONMENT | OBJECT | HAND | PROBE,
    HAND: ENVIRONMENT | OBJECT | PROBE,
    PROBE: ENVIRONMENT | OBJECT | HAND,
}
GROUP_VISUAL, GROUP_COLLISION = 2, 3

STIFF = (0.004, 1.0)  # time constant s and damping ratio of rigid surfaces
PAD = (0.005, 1.0)  # gel skin; what the gel gives beyond this is added by the gel model
PAD_HANDLE_FRICTION = (0.002, 1.0)  # friction of pads on the probe's handle: stiffer, or it drifts in transits

ROLLING = (0.005, 0.0001)  # torsional and rolling friction, m
TIP_FRICTION = 0.2  # polished ball and shaft
HOLDER_FRICTION = 0.3
HAND_FRICTION = 0.4  # housing and finger backs


def set_category(geom: mujoco.MjsGeom, category: int) -> None:
    """Make `geom` collide as one of the categories above, with sliding and torsional friction (condim 4)."""
    geom.contype = category
    geom.conaffinity = AFFINITY[category]
    geom.condim = 4
    geom.group = GROUP_COLLISION
    geom.solref = STIFF


def set_friction(geom: mujoco.MjsGeom, sliding: float, priority: int = 0) -> None:
    """Set friction; of two geoms the one with the larger priority decides, at equal priority the larger friction."""
    geom.friction = (sliding, *ROLLING)
    geom.priority = priority


def set_options(spec: mujoco.MjSpec, step_s: float) -> None:
    """Solver options: one millisecond steps, elliptic cone, no slip, sleeping islands, no silent reset after NaN."""
    o = spec.option
    o.timestep = step_s
    o.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    o.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    o.impratio = 100.0
    o.noslip_iterations = 3
    o.enableflags = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    o.disableflags = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
