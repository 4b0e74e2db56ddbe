"""TODO door of glotouch_bt/bench/search."""

from glotouch_bt.bench.search.bench import Campaign, run_campaign
from glotouch_bt.bench.search.plots import COLOURS
from glotouch_bt.bench.search.summary import quantiles

__all__ = ["COLOURS", "Campaign", "quantiles", "run_campaign"]
