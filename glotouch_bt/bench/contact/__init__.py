"""`bench contact`: trace a calibration square and compare it with the truth."""

from glotouch_bt.bench.contact.bench import METRICS, ContactCampaign, run_campaign
from glotouch_bt.bench.contact.square import TOOLS
