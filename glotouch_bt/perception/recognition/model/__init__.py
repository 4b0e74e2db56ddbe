"""Tactile model of a target computed from its mesh: support widths, pad images, traced outline, nonplanarity."""

from glotouch_bt.perception.recognition.model.outline import (
    SENSING_M,
    TIP_RADIUS_M,
    KindFit,
    Outline,
    first_hit,
    minimum_rectangle,
    outline_of,
    size_variance_m2,
    traced_tips,
)
from glotouch_bt.perception.recognition.model.pads import (
    FINE,
    POOLED,
    Array32,
    PadSpec,
    Patch,
    gel_shift,
    image_feature,
    patch_of,
    pool,
)
from glotouch_bt.perception.recognition.model.parts import VERSION, from_parts, to_parts
from glotouch_bt.perception.recognition.model.raster import hand_axes, mirrored, span
from glotouch_bt.perception.recognition.model.section import (
    LEVELS_M,
    Indices,
    SectionTables,
    TableAt,
    TargetSection,
    section_of,
)
from glotouch_bt.perception.recognition.model.simulated_touches import touch_windows
from glotouch_bt.perception.recognition.model.target import (
    STRIDE,
    Certainty,
    TargetHypothesis,
    TargetModel,
    axes_within,
    table_axes,
)
