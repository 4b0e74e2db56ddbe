"""Who touches whom, and how stiff and rough contacts are.

Friction creep is the trap of rigid-body contact: with a pyramidal cone or a small impratio, objects turn and slide
under loads that friction should hold. The options here (elliptic cone, large impratio, noslip) hold them still.
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

# Time constant s and damping ratio. MuJoCo scales stiffness with the masses that meet: 4 ms is right for light objects,
# but makes the hand (some 15 kg with the motors' inertia) hit the floor like a hammer: 120 N at 20 mm/s. Its housing is
# softer: 50 ms against what is fixed; 10 ms against free bodies (solmix weighs the average), some 2 N/mm a contact
# point, as slender fingers are. PadContacts have a constant of their own.
STIFF = (0.004, 1.0)
HOUSING = (0.050, 1.0)
MIX = {ENVIRONMENT: 1.0, OBJECT: 1000.0, HAND: 150.0, PROBE: 1000.0}
PAD = (0.005, 1.0)  # gel skin; what the gel gives beyond this is added by the gel model
PAD_HANDLE_FRICTION = (0.002, 1.0)  # friction of pads on the probe's handle: stiffer, or it drifts in transits

GEL_TORSION_M = 0.005  # friction torque about the normal per newton: the gel's patch is centimetres wide ...
HARD_TORSION_M = 0.0002  # ... that of a hard ball or foot a fraction of a millimetre
ROLLING_M = 0.0001
TIP_FRICTION = 0.2  # polished ball and shaft
HOLDER_FRICTION = 0.3
HAND_FRICTION = 0.4  # housing and finger backs


def set_category(geom: mujoco.MjsGeom, category: int) -> None:
    """Make `geom` collide as one of the categories above, with sliding and torsional friction (condim 4)."""
    geom.contype = category
    geom.conaffinity = AFFINITY[category]
    geom.condim = 4
    geom.group = GROUP_COLLISION
    geom.solref = HOUSING if category == HAND else STIFF
    geom.solmix = MIX[category]


def set_friction(geom: mujoco.MjsGeom, sliding: float, priority: int = 0, torsion_m: float = HARD_TORSION_M) -> None:
    """Set friction; of two geoms the one with the larger priority decides, at equal priority the larger friction."""
    geom.friction = (sliding, torsion_m, ROLLING_M)
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
