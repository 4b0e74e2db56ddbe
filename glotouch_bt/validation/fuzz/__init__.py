"""`bench fuzz`: missions and fault plans nobody would write, by the thousand: no traceback, no hang, no code run.

`documents` grows missions and plans that are nearly right, `spoiling` breaks them (as data and as bytes), `trial` reads
one, checks it, and runs what passes with scripted leaves; `watch` sees what it must not do; `campaign` counts.
"""

from glotouch_bt.validation.fuzz.campaign import FuzzCampaign, run_campaign
from glotouch_bt.validation.fuzz.trial import BAD

__all__ = ["BAD", "FuzzCampaign", "run_campaign"]
