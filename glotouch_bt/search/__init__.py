"""Where to probe next. Pure: a map in, waypoints out."""

from glotouch_bt.search.frontier import NearestFrontier, SearchPolicy
from glotouch_bt.search.map import Exclusion, SearchMap
from glotouch_bt.search.routes import Routes, segment_is_free

__all__ = ["Exclusion", "NearestFrontier", "Routes", "SearchMap", "SearchPolicy", "segment_is_free"]
