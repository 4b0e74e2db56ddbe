"""Planar outlines of objects estimated from contacts: posterior over shape families, envelopes, polygon geometry."""

from glotouch_bt.perception.touch.outline.belief import current_tips, infer_outline
from glotouch_bt.perception.touch.outline.contours import contour_quality, fit_contour, fit_kind, signed_distance
from glotouch_bt.perception.touch.outline.envelope import KNOWN_QUALITY, envelope, footprint, occupied
from glotouch_bt.perception.touch.outline.mixture import OutlineBelief
from glotouch_bt.perception.touch.outline.moved import infer_outline_from_contacts, split_at_motion
from glotouch_bt.perception.touch.outline.polygons import (
    area_and_centroid,
    convex_hull,
    minimum_rectangle,
    nearest_distance,
    polygon_distance,
)
from glotouch_bt.perception.touch.outline.primitives import wrapped
from glotouch_bt.perception.touch.outline.pushing import estimate_push
