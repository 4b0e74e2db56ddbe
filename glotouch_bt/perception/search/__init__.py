"""Pure planners of tactile exploration: search for objects, outline tracing and height measurement."""

from glotouch_bt.perception.search.belonging import joins, of_another, part_of, taken_by
from glotouch_bt.perception.search.bodies import BESIDE_M, distinct, outline_of
from glotouch_bt.perception.search.candidates import (
    HALF_QUALITY_SD_M,
    admit,
    lost_among,
    quality,
    refined,
    separated,
)
from glotouch_bt.perception.search.exploring import seek_next, trace_bodies
from glotouch_bt.perception.search.map import LEFT_BELOW, SearchMap
from glotouch_bt.perception.search.moves import Move, MoveKind, MoveOutcome, SearchPlan
from glotouch_bt.perception.search.policies import (
    POLICIES,
    ExpectationParams,
    ExpectedFind,
    NearestFrontier,
    SearchPolicy,
    Stretch,
    policy_names,
    search_policy,
)
from glotouch_bt.perception.search.remaining import chance_left, left_in_words
from glotouch_bt.perception.search.routes import Routes, segment_is_free
from glotouch_bt.perception.search.seeking import Sought, seek
from glotouch_bt.perception.search.sharing import contradictions
from glotouch_bt.perception.search.top import BallMove, BallOutcome, Top, TopPlan, TopRule, rounds, top_plan
from glotouch_bt.perception.search.tracing import OutlineTrace, TraceParams, trace, trace_more
