"""For those who write missions: run them with scripted leaves, see what was covered, and which test is missing.

A pytest plugin (`plugin.py`) comes with it; docs/compose.md shows it at work.
"""

from glotouch_bt.mission_testing.casting import ScriptError
from glotouch_bt.mission_testing.outcomes import fails, hangs, ok, raises, real
from glotouch_bt.mission_testing.scripted import ScriptedRun, run_scripted
from glotouch_bt.mission_testing.stand_in import Call
from glotouch_bt.mission_testing.standins import stand_in

__all__ = ["Call", "ScriptError", "ScriptedRun", "fails", "hangs", "ok", "raises", "real", "run_scripted", "stand_in"]
