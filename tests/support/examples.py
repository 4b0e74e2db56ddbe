"""Numbers of examples of properties: fewer where each example is costly, all of them in `make test-studies`."""

from __future__ import annotations

import os

ALL = os.environ.get("GLOTOUCH_ALL_EXAMPLES") == "1"


def examples(few: int, many: int) -> int:
    """The number of examples to try."""
    return many if ALL else few
