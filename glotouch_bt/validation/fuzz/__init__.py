"""`bench fuzz`: random and corrupted missions and fault plans; reading one must never crash, hang or run code.

`documents` generates missions and plans that are nearly right, `corrupt` changes them (as data and as bytes), `trial`
reads one, checks it and runs what passes with scripted leaves, `watch` detects forbidden actions, `campaign` counts.
"""

from glotouch_bt.validation.fuzz.campaign import FuzzCampaign, run_campaign
from glotouch_bt.validation.fuzz.trial import BAD
