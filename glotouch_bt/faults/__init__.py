"""Fault plans, and the wrapper that makes them happen on any Robot: `FaultInjector(robot, plan, ...)`.

A plan is a checked YAML file (`plan`), a fault one of a catalogue (`catalogue`), its moment a trigger (`trigger`), what
it does an effect (`effect`; `wrench`, `touch`, `gripper`, `arm`, `world`, `process`). `proof` says what happened.
"""

from glotouch_bt.faults.catalogue import CATALOGUE, FaultKind
from glotouch_bt.faults.injector import FaultInjector
from glotouch_bt.faults.models import wrong_models
from glotouch_bt.faults.plan import FaultPlan, FaultSpec, check_plan, read_plan
from glotouch_bt.faults.run_listener import ListeningRecord, injector_in
from glotouch_bt.faults.trigger import Lasting, Repeat, When

__all__ = [
    "CATALOGUE",
    "FaultInjector",
    "FaultKind",
    "FaultPlan",
    "FaultSpec",
    "Lasting",
    "ListeningRecord",
    "Repeat",
    "When",
    "check_plan",
    "injector_in",
    "read_plan",
    "wrong_models",
]
