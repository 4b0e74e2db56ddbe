"""TODO door of glotouch_bt/bench."""

from glotouch_bt.bench.retrieve import Campaign, run_campaign, targets_of
from glotouch_bt.bench.speed import SpeedStudy, run_study
from glotouch_bt.bench.statistics import Rate, bootstrap_mean, wilson

__all__ = ["Campaign", "Rate", "SpeedStudy", "bootstrap_mean", "run_campaign", "run_study", "targets_of", "wilson"]
