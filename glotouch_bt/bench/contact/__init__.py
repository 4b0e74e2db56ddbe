"""TODO door of glotouch_bt/bench/contact."""

from glotouch_bt.bench.contact.bench import METRICS, Campaign, run_campaign
from glotouch_bt.bench.contact.square import TOOLS

__all__ = ["METRICS", "TOOLS", "Campaign", "run_campaign"]
