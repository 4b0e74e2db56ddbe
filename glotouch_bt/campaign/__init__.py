"""One engine for every campaign: a trial is a folder that one process claims; executors only start trials.

It holds the settings of a campaign, what a result depends on, the trial's folder, the engine, and the executors.
"""

from glotouch_bt.campaign.cluster import ClusterPool
from glotouch_bt.campaign.engine import ShardDone, run_trials
from glotouch_bt.campaign.identity import (
    changes,
    code_versions,
    described_code,
    digest,
    folder_digests,
    plain,
)
from glotouch_bt.campaign.settings import MANIFEST, Campaign, Shard, open_folder
from glotouch_bt.campaign.source import CHANGED, ROOT, commit_of_source
from glotouch_bt.campaign.tables import write_summary, write_table
from glotouch_bt.campaign.trial import OnRow, Row, Trial, crashed, launch_trial, perform, silent
from glotouch_bt.campaign.trial_folder import TRIAL, TrialFolder
from glotouch_bt.campaign.workers import Claimed, TrialLost, WorkerLost, WorkerPool
