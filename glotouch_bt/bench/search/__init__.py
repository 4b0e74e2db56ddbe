"""`bench search`: how soon exploration finds every object, by search policy."""

from glotouch_bt.bench.search.bench import SearchCampaign, run_campaign
from glotouch_bt.bench.search.counting import CountCampaign, run_count_campaign
from glotouch_bt.bench.search.plots import COLOURS
from glotouch_bt.bench.search.scoring import Found, TrueLayout, assign
from glotouch_bt.bench.search.summary import quantiles
from glotouch_bt.bench.search.trial import AGAIN, sections_of, true_layout
