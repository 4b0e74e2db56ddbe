"""Compile every numerical loop once, before many processes at a time would each do it for themselves."""

from __future__ import annotations

from importlib.metadata import entry_points

import glotouch_bt.runs.launch  # noqa: F401  # with what every run needs
from glotouch_bt.lazy import load_all

if __name__ == "__main__":
    for group in ("glotouch_bt.backends", "glotouch_bt.skills"):
        for point in entry_points(group=group):
            point.load()
    load_all()
