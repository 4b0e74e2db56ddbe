"""TODO door of glotouch_bt/perception/touch/outline."""

from glotouch_bt.perception.touch.outline.belief import believe_outline, present_tips
from glotouch_bt.perception.touch.outline.contours import (
    consistent,
    contour_quality,
    fit_contour,
    fit_kind,
    signed_distance,
)
from glotouch_bt.perception.touch.outline.envelope import envelope
from glotouch_bt.perception.touch.outline.mixture import OutlineBelief, informative_direction
from glotouch_bt.perception.touch.outline.moved import believe_contacts, split_moved
from glotouch_bt.perception.touch.outline.polygons import convex_hull, polygon_distance
from glotouch_bt.perception.touch.outline.primitives import wrapped
from glotouch_bt.perception.touch.outline.pushing import pushed
from glotouch_bt.perception.touch.outline.tracing import largest_gap_direction, needs_more, next_direction, widest_gap

__all__ = [
    "OutlineBelief",
    "believe_contacts",
    "believe_outline",
    "consistent",
    "contour_quality",
    "convex_hull",
    "envelope",
    "fit_contour",
    "fit_kind",
    "informative_direction",
    "largest_gap_direction",
    "needs_more",
    "next_direction",
    "polygon_distance",
    "present_tips",
    "pushed",
    "signed_distance",
    "split_moved",
    "widest_gap",
    "wrapped",
]
