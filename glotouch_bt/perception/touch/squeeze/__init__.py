"""TODO door of glotouch_bt/perception/touch/squeeze."""

from glotouch_bt.perception.touch.squeeze.object_motion import Yielding, watch_yielding
from glotouch_bt.perception.touch.squeeze.patches import (
    PatchStats,
    evidence_weight,
    patch_statistics,
    relative_nonplanarity,
)
from glotouch_bt.perception.touch.squeeze.plateau import (
    Plateau,
    PlateauParams,
    find_plateau,
    make_layer,
    temporal_median,
)

__all__ = [
    "PatchStats",
    "Plateau",
    "PlateauParams",
    "Yielding",
    "evidence_weight",
    "find_plateau",
    "make_layer",
    "patch_statistics",
    "relative_nonplanarity",
    "temporal_median",
    "watch_yielding",
]
