"""Recognition of the target among touched candidates: model of its STL, matchers, ranking.

model = TargetModel.from_mesh(mesh, PadSpec())
ranking = MATCHERS["likelihood"](model, touchsets)
"""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door
from glotouch_bt.perception.recognition.decision import PARTS, Closure, Fit, Gates, Match, ProbeTouch, Ranking, rank

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition.likelihood import Belief, expected_gain, gain_of_one, infer_belief
    from glotouch_bt.perception.recognition.matchers import MATCHERS, Matcher
    from glotouch_bt.perception.recognition.model import PadSpec, TargetModel
    from glotouch_bt.perception.recognition.schedule import (
        CHANGE_S,
        ProbeOption,
        enough,
        excluded,
        hardly_felt,
        next_probe_touch,
        wanted,
    )
    from glotouch_bt.perception.recognition.touched import (
        Encounter,
        FeltClosure,
        TouchedObject,
        beyond_jaws_m,
        encounter_of,
        touched_model,
    )

__getattr__ = lazy_door(
    __name__,
    **dict.fromkeys(("Belief", "infer_belief", "expected_gain", "gain_of_one"), "likelihood"),
    **dict.fromkeys(("MATCHERS", "Matcher"), "matchers"),
    **dict.fromkeys(("PadSpec", "TargetModel"), "model"),
    **dict.fromkeys(
        ("Encounter", "FeltClosure", "TouchedObject", "beyond_jaws_m", "encounter_of", "touched_model"), "touched"
    ),
    **dict.fromkeys(
        ("CHANGE_S", "ProbeOption", "enough", "excluded", "hardly_felt", "next_probe_touch", "wanted"), "schedule"
    ),
)
