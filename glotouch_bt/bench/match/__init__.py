"""`bench match`: how well matchers tell the target from other objects, on TouchSets of the real skills."""

from glotouch_bt.bench.match.bench import MatchCampaign, run_campaign
from glotouch_bt.bench.match.dataset import Layout, Touched
from glotouch_bt.bench.match.methods import DEFAULT, chosen
from glotouch_bt.bench.match.release import Dataset, load_dataset, make_dataset
from glotouch_bt.bench.match.synthetic import sampled_layout
from glotouch_bt.bench.match.trials import decide
