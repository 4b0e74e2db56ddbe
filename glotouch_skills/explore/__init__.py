"""TODO door of glotouch_skills/explore."""

from glotouch_skills.explore.guarded_sweep import GuardedSweepParams
from glotouch_skills.explore.orbit_probe import OrbitProbeParams
from glotouch_skills.explore.refine_outline import RefineOutlineParams

__all__ = ["GuardedSweepParams", "OrbitProbeParams", "RefineOutlineParams"]
