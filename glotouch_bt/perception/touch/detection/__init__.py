"""Detection, dating and localisation of contacts in the wrist's signal."""

from glotouch_bt.perception.touch.detection.baseline import Baseline, fit_baseline
from glotouch_bt.perception.touch.detection.detector import ContactGuard, Onset
from glotouch_bt.perception.touch.detection.filtering import LowPass
from glotouch_bt.perception.touch.detection.fusion import TipFusion
from glotouch_bt.perception.touch.detection.guard_params import GuardParams
from glotouch_bt.perception.touch.detection.hard_stop import HardStop, HardTrip
from glotouch_bt.perception.touch.detection.inertia import MeasuredInertia, Payload
from glotouch_bt.perception.touch.detection.localisation import (
    Disc,
    Polygon,
    Section,
    contact_direction,
    contact_point,
    section_point,
)
from glotouch_bt.perception.touch.detection.settling import settled
