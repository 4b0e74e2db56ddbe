"""Target known only by touch: what was felt of it in some encounters, and the `TargetModel` that follows from it."""

from glotouch_bt.perception.recognition.touched.memory import Encounter, FeltClosure, TouchedObject, encounter_of
from glotouch_bt.perception.recognition.touched.tables import touched_model
