"""The matching loss as the paper writes it, each term switchable. Pure. Readings: docs/explanation/paper_matcher.md.

ranking = paper_matcher(PaperParams())(model, touchsets)
"""

from glotouch_bt.perception.recognition.paper.matcher import paper_match, paper_matcher, paper_rank
from glotouch_bt.perception.recognition.paper.params import TERMS, WIDTH_TERMS, PaperParams

__all__ = ["TERMS", "WIDTH_TERMS", "PaperParams", "paper_match", "paper_matcher", "paper_rank"]
