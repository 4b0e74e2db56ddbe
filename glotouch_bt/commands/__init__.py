"""The commands of `glotouch`: one file for each; they parse words, call the library and print, no logic.

Heavy imports stand inside the commands, so that `glotouch --help` is quick.
"""

from collections.abc import Callable, Mapping

from glotouch_bt.commands.backends import backends, keys
from glotouch_bt.commands.bench import bench
from glotouch_bt.commands.check import check
from glotouch_bt.commands.doctor import doctor
from glotouch_bt.commands.faults import faults
from glotouch_bt.commands.missions import missions
from glotouch_bt.commands.nodes import nodes, schema
from glotouch_bt.commands.objects import objects
from glotouch_bt.commands.replay import replay
from glotouch_bt.commands.report import report, view
from glotouch_bt.commands.resume import resume
from glotouch_bt.commands.run import run
from glotouch_bt.commands.skills import skills
from glotouch_bt.commands.test import run_tests
from glotouch_bt.commands.tree import tree

COMMANDS: Mapping[str, Mapping[str, Callable[..., None]]] = {
    "Run missions": {"run": run, "resume": resume, "replay": replay, "report": report, "view": view},
    "Write missions": {
        "check": check,
        "test": run_tests,
        "tree": tree,
        "missions": missions,
        "nodes": nodes,
        "skills": skills,
        "schema": schema,
    },
    "Objects, robots and faults": {
        "objects": objects,
        "backends": backends,
        "doctor": doctor,
        "keys": keys,
        "faults": faults,
    },
}
"""Commands by use, in the order of `glotouch --help`."""
