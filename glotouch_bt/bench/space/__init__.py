"""`bench space`: push objects, lift them out and set them down, and compare the map with the truth."""

from glotouch_bt.bench.space.bench import ACTS, SpaceCampaign, run_campaign
