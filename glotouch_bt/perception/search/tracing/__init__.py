"""TODO door of glotouch_bt/perception/search/tracing."""

from glotouch_bt.perception.search.tracing.trace import trace, trace_more
from glotouch_bt.perception.search.tracing.trace_params import TraceParams
from glotouch_bt.perception.search.tracing.trace_state import Trace

__all__ = ["Trace", "TraceParams", "trace", "trace_more"]
