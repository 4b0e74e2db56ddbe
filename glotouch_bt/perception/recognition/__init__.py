"""Which of the touched candidates is the target: finite-window model of an STL, matchers, ranking. Pure.

model = TargetModel.from_mesh(mesh, PadSpec())
ranking = MATCHERS["likelihood"](model, touchsets)
"""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door
from glotouch_bt.perception.recognition.decision import Closure, Fit, Gates, Match, Ranking, rank

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition.gain import Belief, believe, expected_gain
    from glotouch_bt.perception.recognition.matchers import DEFAULT_MATCHER, MATCHERS, Matcher
    from glotouch_bt.perception.recognition.model import PadSpec, TargetModel

__getattr__ = lazy_door(
    __name__,
    **dict.fromkeys(("Belief", "believe", "expected_gain"), "gain"),
    **dict.fromkeys(("DEFAULT_MATCHER", "MATCHERS", "Matcher"), "matchers"),
    **dict.fromkeys(("PadSpec", "TargetModel"), "model"),
)

__all__ = [
    "DEFAULT_MATCHER",
    "MATCHERS",
    "Belief",
    "Closure",
    "Fit",
    "Gates",
    "Match",
    "Matcher",
    "PadSpec",
    "Ranking",
    "TargetModel",
    "believe",
    "expected_gain",
    "rank",
]
