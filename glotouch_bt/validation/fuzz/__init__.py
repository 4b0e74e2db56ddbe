"""`bench fuzz`: random and corrupted inputs of several kinds; using one must never crash, hang or run code.

A kind (`kind`) makes an input and tries it; `campaign` registers the kinds. `missions` are grown by `documents` and
changed by `corrupt`, as data and as bytes. `trial` runs one trial while `watch` detects forbidden actions.
"""

from glotouch_bt.validation.fuzz.campaign import KINDS, FuzzCampaign, run_campaign
from glotouch_bt.validation.fuzz.kind import BAD
