"""Which of the touched candidates is the target: finite-window model of an STL, matchers, ranking. Pure.

model = TargetModel.from_mesh(mesh, PadSpec())
ranking = MATCHERS["likelihood"](model, touchsets)
"""

from glotouch_bt.recognition.decision import Closure, Fit, Gates, Match, Ranking, rank
from glotouch_bt.recognition.matchers import DEFAULT_MATCHER, MATCHERS, Matcher
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.recognition.pads import PadSpec

__all__ = [
    "DEFAULT_MATCHER",
    "MATCHERS",
    "Closure",
    "Fit",
    "Gates",
    "Match",
    "Matcher",
    "PadSpec",
    "Ranking",
    "TargetModel",
    "rank",
]
