"""TODO door of glotouch_bt/perception/touch/detection."""

from glotouch_bt.perception.touch.detection.baseline import Baseline, fit_baseline
from glotouch_bt.perception.touch.detection.detector import ContactGuard, Onset
from glotouch_bt.perception.touch.detection.filtering import LowPass
from glotouch_bt.perception.touch.detection.fusion import TipFusion
from glotouch_bt.perception.touch.detection.guard_params import GuardParams
from glotouch_bt.perception.touch.detection.hard_stop import HardStop, HardTrip
from glotouch_bt.perception.touch.detection.inertia import Carried, MeasuredInertia
from glotouch_bt.perception.touch.detection.localisation import (
    Disc,
    Polygon,
    Section,
    contact_direction,
    contact_point,
    disc_support,
    polygon_support,
    section_point,
)
from glotouch_bt.perception.touch.detection.settling import reaction_direction, settled

__all__ = [
    "Baseline",
    "Carried",
    "ContactGuard",
    "Disc",
    "GuardParams",
    "HardStop",
    "HardTrip",
    "LowPass",
    "MeasuredInertia",
    "Onset",
    "Polygon",
    "Section",
    "TipFusion",
    "contact_direction",
    "contact_point",
    "disc_support",
    "fit_baseline",
    "polygon_support",
    "reaction_direction",
    "section_point",
    "settled",
]
