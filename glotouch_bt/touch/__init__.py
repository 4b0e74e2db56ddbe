"""What touching means: contacts found in a wrist's signal, outlines fitted to them, squeezes turned into evidence.

Pure: arrays in, values out. Knows no robot, tree or file.
"""

from glotouch_bt.touch.baseline import Baseline, fit_baseline
from glotouch_bt.touch.belief import believe_outline, present_tips
from glotouch_bt.touch.contours import consistent, contour_quality, fit_contour, fit_kind, signed_distance
from glotouch_bt.touch.detector import ContactGuard, Onset
from glotouch_bt.touch.envelope import envelope
from glotouch_bt.touch.filtering import LowPass
from glotouch_bt.touch.fusion import TipFusion
from glotouch_bt.touch.guard_params import GuardParams
from glotouch_bt.touch.hard_stop import HardStop, HardTrip
from glotouch_bt.touch.inertia import Carried, MeasuredInertia
from glotouch_bt.touch.latency import LatencyEstimate, latency_from_two_speeds
from glotouch_bt.touch.localisation import contact_direction, contact_point, disc_support, polygon_support
from glotouch_bt.touch.mixture import OutlineBelief, informative_direction
from glotouch_bt.touch.moved import believe_contacts, split_moved
from glotouch_bt.touch.patches import PatchStats, evidence_weight, patch_statistics, relative_nonplanarity
from glotouch_bt.touch.plateau import Plateau, PlateauParams, find_plateau, make_layer, temporal_median
from glotouch_bt.touch.pushing import pushed
from glotouch_bt.touch.settling import reaction_direction, settled
from glotouch_bt.touch.tracing import largest_gap_direction, needs_more, next_direction, widest_gap
from glotouch_bt.touch.values import (
    Candidate,
    Contact,
    Contour,
    ContourFamily,
    ContourKind,
    Layer,
    Ring,
    TouchSequence,
    TouchSet,
)
from glotouch_bt.touch.yielding import Yielding, watch_yielding

__all__ = [
    "Baseline",
    "Candidate",
    "Carried",
    "Contact",
    "ContactGuard",
    "Contour",
    "ContourFamily",
    "ContourKind",
    "GuardParams",
    "HardStop",
    "HardTrip",
    "LatencyEstimate",
    "Layer",
    "LowPass",
    "MeasuredInertia",
    "Onset",
    "OutlineBelief",
    "PatchStats",
    "Plateau",
    "PlateauParams",
    "Ring",
    "TipFusion",
    "TouchSequence",
    "TouchSet",
    "Yielding",
    "believe_contacts",
    "believe_outline",
    "consistent",
    "contact_direction",
    "contact_point",
    "contour_quality",
    "disc_support",
    "envelope",
    "evidence_weight",
    "find_plateau",
    "fit_baseline",
    "fit_contour",
    "fit_kind",
    "informative_direction",
    "largest_gap_direction",
    "latency_from_two_speeds",
    "make_layer",
    "needs_more",
    "next_direction",
    "patch_statistics",
    "polygon_support",
    "present_tips",
    "pushed",
    "reaction_direction",
    "relative_nonplanarity",
    "settled",
    "signed_distance",
    "split_moved",
    "temporal_median",
    "watch_yielding",
    "widest_gap",
]
