"""Tracing of one object's outline."""

from glotouch_bt.perception.search.tracing.trace import trace, trace_more
from glotouch_bt.perception.search.tracing.trace_params import Elsewhere, TraceParams
from glotouch_bt.perception.search.tracing.trace_state import OutlineTrace
