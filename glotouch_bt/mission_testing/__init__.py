"""Test missions: run them with scripted leaves and see which outcomes were covered. A pytest plugin comes with it.

Names are imported on first use, because pytest loads the plugin in every session of an environment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door

if TYPE_CHECKING:
    from glotouch_bt.mission_testing.call import Call
    from glotouch_bt.mission_testing.casting import ScriptError
    from glotouch_bt.mission_testing.outcomes import fails, hangs, ok, raises, real
    from glotouch_bt.mission_testing.random_script import ScriptMaker
    from glotouch_bt.mission_testing.scripted import RunsAway, ScriptedRun, run_scripted
    from glotouch_bt.mission_testing.standins import stand_in

__getattr__ = lazy_door(
    __name__,
    Call="call",
    ScriptError="casting",
    fails="outcomes",
    hangs="outcomes",
    ok="outcomes",
    raises="outcomes",
    real="outcomes",
    ScriptMaker="random_script",
    RunsAway="scripted",
    ScriptedRun="scripted",
    run_scripted="scripted",
    stand_in="standins",
)
