"""Run a loaded mission: the tick loop, pauses, the safe stop, and the watchdog over a hanging skill."""

from glotouch_bt.mission.execution.control import Control, TimedPauses
from glotouch_bt.mission.execution.runner import Outcome, default_arm, run_mission
from glotouch_bt.mission.execution.watchdog import SkillHung, deferred_interrupt
