"""Target known only by touch: its touch data, and the `TargetModel` made from them."""

from glotouch_bt.perception.recognition.touched.memory import (
    Encounter,
    FeltClosure,
    TouchedObject,
    beyond_jaws_m,
    encounter_of,
)
from glotouch_bt.perception.recognition.touched.tables import touched_model
