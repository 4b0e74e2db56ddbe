"""`glotouch bench ...`, experiments on the executive and on the path to the hardware: one file for each."""

from glotouch_bt.commands.bench.executive.check import check
from glotouch_bt.commands.bench.executive.faults import faults
from glotouch_bt.commands.bench.executive.forces import forces
from glotouch_bt.commands.bench.executive.fuzz import fuzz
from glotouch_bt.commands.bench.executive.link import link
from glotouch_bt.commands.bench.executive.pause import pause
from glotouch_bt.commands.bench.executive.resume import resume
