"""`bench robustness`: how much each property of objects, gel, gripper and arm matters to recognition."""

from glotouch_bt.bench.robustness.axes import AXES
from glotouch_bt.bench.robustness.bench import RobustnessCampaign, run_campaign
from glotouch_bt.bench.robustness.missions import run_missions
from glotouch_bt.bench.robustness.plot import rates_of
