"""Pure planners of tactile exploration: search for objects, outline tracing and height measurement."""

from glotouch_bt.perception.search.candidates import Admitted, admit, elsewhere_m, joins, of_another, part_of, refined
from glotouch_bt.perception.search.map import Exclusion, SearchMap
from glotouch_bt.perception.search.moves import Move, MoveKind, MoveOutcome, SearchPlan, T
from glotouch_bt.perception.search.policies import (
    PAPER_PASSES,
    POLICIES,
    ExpectationParams,
    ExpectedFind,
    NearestFrontier,
    SearchPolicy,
    Stretch,
    search_policy,
)
from glotouch_bt.perception.search.routes import Routes, segment_is_free
from glotouch_bt.perception.search.seeking import Sought, seek
from glotouch_bt.perception.search.top import BallMove, BallOutcome, Top, TopPlan, TopRule, rounds, top_plan
from glotouch_bt.perception.search.tracing import OutlineTrace, TraceParams, trace, trace_more

__all__ = [
    "PAPER_PASSES",
    "POLICIES",
    "Admitted",
    "BallMove",
    "BallOutcome",
    "Exclusion",
    "ExpectationParams",
    "ExpectedFind",
    "Move",
    "MoveKind",
    "MoveOutcome",
    "NearestFrontier",
    "OutlineTrace",
    "Routes",
    "SearchMap",
    "SearchPlan",
    "SearchPolicy",
    "Sought",
    "Stretch",
    "T",
    "Top",
    "TopPlan",
    "TopRule",
    "TraceParams",
    "admit",
    "elsewhere_m",
    "joins",
    "of_another",
    "part_of",
    "refined",
    "rounds",
    "search_policy",
    "seek",
    "segment_is_free",
    "top_plan",
    "trace",
    "trace_more",
]
