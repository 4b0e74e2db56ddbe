"""Tracing of one object's outline."""

from glotouch_bt.perception.search.tracing.trace import Elsewhere, trace, trace_more
from glotouch_bt.perception.search.tracing.trace_params import TraceParams
from glotouch_bt.perception.search.tracing.trace_state import OutlineTrace
