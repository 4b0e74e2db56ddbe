"""`bench compare`: paired comparison of two campaign folders."""

from glotouch_bt.bench.compare.comparison import compare_folders
from glotouch_bt.bench.compare.paired import mcnemar, paired_mean, paired_rate
