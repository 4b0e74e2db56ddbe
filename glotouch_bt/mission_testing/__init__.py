"""Test missions: run them with scripted leaves and see which outcomes were covered. A pytest plugin comes with it.

Names are imported on first use, because pytest loads the plugin in every session of an environment.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from glotouch_bt.mission_testing.call import Call
    from glotouch_bt.mission_testing.casting import ScriptError
    from glotouch_bt.mission_testing.outcomes import fails, hangs, ok, raises, real
    from glotouch_bt.mission_testing.random_script import ScriptMaker
    from glotouch_bt.mission_testing.scripted import RunsAway, ScriptedRun, run_scripted
    from glotouch_bt.mission_testing.standins import stand_in

_HOME = {
    "Call": "call",
    "ScriptError": "casting",
    "RunsAway": "scripted",
    "ScriptMaker": "random_script",
    "ScriptedRun": "scripted",
    "fails": "outcomes",
    "hangs": "outcomes",
    "ok": "outcomes",
    "raises": "outcomes",
    "real": "outcomes",
    "run_scripted": "scripted",
    "stand_in": "standins",
}

__all__ = [
    "Call",
    "RunsAway",
    "ScriptError",
    "ScriptMaker",
    "ScriptedRun",
    "fails",
    "hangs",
    "ok",
    "raises",
    "real",
    "run_scripted",
    "stand_in",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
