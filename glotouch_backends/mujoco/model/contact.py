"""Collision categories, and stiffness and friction of contacts.

With a pyramidal friction cone or a small impratio, rigid-body contacts creep: objects turn and slide under loads that
friction should hold. An elliptic cone, a large impratio and noslip iterations hold them still. An impratio of 1e4 to
1e8 without noslip saves a fifth of a step with the probe, but a hand that rests in contact creeps for seconds.
"""

from __future__ import annotations

import mujoco

# A geom has one category (contype) and collides with the categories of its affinity. The gel pads hold the probe's
# handle in contact pairs of their own (`add_probe`).
ENVIRONMENT, OBJECT, HAND, GEL, PROBE, HANDLE = 1, 2, 4, 8, 16, 32
AFFINITY = {
    ENVIRONMENT: OBJECT | HAND | GEL | PROBE | HANDLE,
    OBJECT: ENVIRONMENT | OBJECT | HAND | GEL | PROBE | HANDLE,
    HAND: ENVIRONMENT | OBJECT | PROBE | HANDLE,
    GEL: ENVIRONMENT | OBJECT | PROBE,
    PROBE: ENVIRONMENT | OBJECT | HAND | GEL,
    HANDLE: ENVIRONMENT | OBJECT | HAND,
}
GROUP_VISUAL, GROUP_COLLISION = 2, 3

# Contacts: (time constant s, damping ratio). MuJoCo scales the stiffness with the masses in contact. 4 ms suits light
# bodies. But an object of 4 ms that is wedged between jaws and floor loses and regains contacts from step to step.
# Steps of 1 ms are too coarse for it: it pushes the hand with up to 34 N. With 8 ms the same missions stay below
# 12 N (`bench retrieve --trials 10 --per-seed 1 --seed 59031`, ea3b5568 and b89fe783). The hand (15 kg with the motors'
# inertia) would hit the floor with 120 N at 20 mm/s and 4 ms. The housing is softer still: 50 ms against fixed bodies,
# 13 ms against free ones (solmix weighs the average), about 2 N/mm a contact point, like slender fingers. The pads have
# their own constant. Source: ours.
STIFF = (0.004, 1.0)
FREE_BODY = (0.008, 1.0)
HOUSING = (0.050, 1.0)
SOLREF = {HAND: HOUSING, GEL: HOUSING, OBJECT: FREE_BODY}
MIX = {ENVIRONMENT: 1.0, OBJECT: 1000.0, HAND: 150.0, GEL: 150.0, PROBE: 1000.0, HANDLE: 1000.0}
OBJECT_IMPEDANCE = 0.5
"""Impedance of the contacts of free objects (MuJoCo's solimp, 0..1; 1: rigid). With MuJoCo's default of 0.9, an object
that rocks between the jaws and meets the floor is stopped within a step, and the hand with it. Source: ours, to lower
such peaks: 32.7 and 37.0 N in `bench retrieve --conditions realistic`, train of seeds 36013 and 36026, 3643226."""
PAD = (0.007, 1.0)
PAD_IMPEDANCE = (0.3, 0.95, 0.0016)
"""Impedance of a gel pad (MuJoCo's solimp): at its surface, at the indentation where the gel is rigid, and that
indentation, m (`sensing.gel.BOTTOM_M`). Source: ours; with PAD, a curved object sinks about as deep as the gel's law
says. A stiffer pad whose edge slips onto a ledge of the object throws the hand up: 46.8 N (`bench retrieve --trials 10
--per-seed 1 --seed 59041`, train of 59048, b89fe783)."""
PAD_HANDLE = (0.0035, 1.0)  # two contacts are as stiff as four of (0.005, 1.0)
PAD_HANDLE_FRICTION = (0.002, 1.0)  # pads on the probe's handle: stiffer, or the probe drifts during transfers

GEL_TORSION_M = 0.005
"""Torsional friction of a gel pad, m: its contact patch is centimetres wide. Source: ours."""
HARD_TORSION_M = 0.0002
"""Torsional friction of a hard ball or foot, m: its patch is a fraction of a millimetre wide. Source: ours."""
ROLLING_M = 0.0001
"""Rolling friction, m. Source: ours."""
TIP_FRICTION = 0.2
"""Sliding friction of the polished ball and shaft. Source: ours."""
HOLDER_FRICTION = 0.3
"""Sliding friction of the probe in its stand. Source: ours."""
HAND_FRICTION = 0.4
"""Sliding friction of housing and finger backs. Source: ours."""


def set_category(geom: mujoco.MjsGeom, category: int) -> None:
    """Set the collision category of `geom`, with sliding and torsional friction (condim 4)."""
    geom.contype = category
    geom.conaffinity = AFFINITY[category]
    geom.condim = 4
    geom.group = GROUP_COLLISION
    geom.solref = SOLREF.get(category, STIFF)
    geom.solmix = MIX[category]
    if category == OBJECT:
        geom.solimp[:2] = OBJECT_IMPEDANCE


def set_softness(spec: mujoco.MjSpec, contact_s: float, housing_s: float) -> None:
    """Replace the time constants of `STIFF` and `HOUSING` in every geom, and scale `FREE_BODY` with the former.

    The gel pads keep theirs.
    """
    free_s = FREE_BODY[0] / STIFF[0] * contact_s
    new = {STIFF: (contact_s, STIFF[1]), FREE_BODY: (free_s, FREE_BODY[1]), HOUSING: (housing_s, HOUSING[1])}
    for geom in spec.geoms:
        geom.solref = new.get(tuple(geom.solref), geom.solref)


def set_friction(geom: mujoco.MjsGeom, sliding: float, priority: int = 0, torsion_m: float = HARD_TORSION_M) -> None:
    """Set friction. Of two geoms the larger priority decides; at equal priority the larger friction."""
    geom.friction = (sliding, torsion_m, ROLLING_M)
    geom.priority = priority


def set_options(spec: mujoco.MjSpec, step_s: float) -> None:
    """Set the solver's options: time step, elliptic cone, noslip, sleeping islands, no automatic reset after a NaN."""
    o = spec.option
    o.timestep = step_s
    o.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    o.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    o.impratio = 100.0
    o.noslip_iterations = 3
    o.enableflags = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    o.disableflags = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
