"""Where to probe next. Pure: a map in, moves out."""

from glotouch_bt.search.candidates import Admitted, admit, elsewhere_m, joins, of_another, part_of, refined
from glotouch_bt.search.expectation import ExpectationParams, ExpectedFind
from glotouch_bt.search.frontier import PAPER_PASSES, NearestFrontier
from glotouch_bt.search.map import Exclusion, SearchMap
from glotouch_bt.search.moves import Felt, Move, MoveKind, Plan
from glotouch_bt.search.policies import POLICIES, search_policy
from glotouch_bt.search.policy import SearchPolicy, Stretch
from glotouch_bt.search.routes import Routes, segment_is_free
from glotouch_bt.search.seeking import Sought, seek
from glotouch_bt.search.trace_params import TraceParams
from glotouch_bt.search.trace_state import Trace
from glotouch_bt.search.tracing import trace, trace_more

__all__ = [
    "PAPER_PASSES",
    "POLICIES",
    "Admitted",
    "Exclusion",
    "ExpectationParams",
    "ExpectedFind",
    "Felt",
    "Move",
    "MoveKind",
    "NearestFrontier",
    "Plan",
    "Routes",
    "SearchMap",
    "SearchPolicy",
    "Sought",
    "Stretch",
    "Trace",
    "TraceParams",
    "search_policy",
    "seek",
    "admit",
    "elsewhere_m",
    "joins",
    "of_another",
    "part_of",
    "refined",
    "segment_is_free",
    "trace",
    "trace_more",
]
