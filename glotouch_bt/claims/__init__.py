"""The figures that the documentation claims: their table, the commands that measure them, and their publication."""

from glotouch_bt.claims.collect import collect
from glotouch_bt.claims.run import ClaimEnd, finished, run_claims
from glotouch_bt.claims.table import Claim, chosen, read_claims, scaled
