"""Experiments that measure the method: one file or folder a bench, each with its trials, figures and plots."""

from glotouch_bt.bench.retrieve import RetrieveCampaign, run_campaign, succeeded, targets_of
from glotouch_bt.bench.speed import run_study
from glotouch_bt.bench.statistics import Rate, bootstrap_mean, wilson
