"""Fault injection: checked fault plans, the catalogue of faults, and the robot wrapper that applies them.

To add a fault, write its effect in `effects` and one row in `effects.catalogue`.
"""

from glotouch_bt.faults.effects import CATALOGUE
from glotouch_bt.faults.injector import FaultInjector
from glotouch_bt.faults.models import wrong_models
from glotouch_bt.faults.plan import FaultPlan, FaultSpec, check_plan, read_plan
from glotouch_bt.faults.run_listener import ListeningRecord, injector_in
from glotouch_bt.faults.trigger import Duration, Repeat, When
