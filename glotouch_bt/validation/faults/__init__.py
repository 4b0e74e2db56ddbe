"""`bench faults`: every class of fault in every skill it can affect, each trial compared with its unfaulted twin."""

from glotouch_bt.validation.faults.campaign import FaultCampaign, few_objects, run_campaign
from glotouch_bt.validation.faults.cases import chosen_cases, chosen_skills
from glotouch_bt.validation.faults.exhaustive import Exhaustive, run_exhaustive
from glotouch_bt.validation.faults.trial import VERDICTS
