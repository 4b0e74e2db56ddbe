"""`bench compare`: paired comparison of two campaign folders."""

from glotouch_bt.bench.compare.comparison import compare_folders
from glotouch_bt.bench.compare.folders import Measured, Recorded, read_campaign
from glotouch_bt.bench.compare.paired import PairedMean, PairedRate, mcnemar, paired_mean, paired_rate
