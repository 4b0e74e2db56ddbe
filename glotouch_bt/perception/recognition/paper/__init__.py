"""Matching loss of the paper with switchable terms; interpretation in docs/explanation/paper_matcher.md.

ranking = paper_matcher(PaperParams())(model, touchsets)
"""

from glotouch_bt.perception.recognition.paper.matcher import paper_match, paper_matcher, paper_rank
from glotouch_bt.perception.recognition.paper.params import TERMS, PaperParams
