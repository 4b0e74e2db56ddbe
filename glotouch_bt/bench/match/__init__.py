"""`bench match`: TouchSets recorded by the real skills, and how well matchers tell the target from them."""

from glotouch_bt.bench.match.bench import Campaign, run_campaign
from glotouch_bt.bench.match.methods import chosen

__all__ = ["Campaign", "chosen", "run_campaign"]
