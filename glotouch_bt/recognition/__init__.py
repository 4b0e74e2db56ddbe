"""Which of the touched candidates is the target: finite-window model of an STL, matching loss, ranking. Pure.

model = TargetModel.from_mesh(mesh, PadSpec())
ranking = rank([match(model, touchset, LossParams()) for touchset in touchsets])
"""

from glotouch_bt.recognition.decision import Closure, Fit, Gates, Match, Ranking, rank
from glotouch_bt.recognition.loss import match
from glotouch_bt.recognition.matchers import DEFAULT_MATCHER, MATCHERS, Matcher
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.recognition.pads import PadSpec
from glotouch_bt.recognition.params import LossParams, MatchParams

__all__ = [
    "DEFAULT_MATCHER",
    "MATCHERS",
    "Closure",
    "Fit",
    "Gates",
    "LossParams",
    "Match",
    "MatchParams",
    "Matcher",
    "PadSpec",
    "Ranking",
    "TargetModel",
    "match",
    "rank",
]
