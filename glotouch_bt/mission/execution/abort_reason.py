"""The reason why a mission was aborted from outside the tree."""

from __future__ import annotations

import re
import traceback
from pathlib import Path

from glotouch_bt.mission.checkpoint import WorldChanged
from glotouch_bt.mission.execution.control import Preempted
from glotouch_bt.mission.execution.watchdog import SkillHung
from glotouch_bt.mission.tree import NodeFailure
from glotouch_bt.robot import BackendError, GuardTripped
from glotouch_bt.skill import Reason


def abort_failure(error: BaseException, node: str) -> NodeFailure:
    """Return the error raised at a node as a failure with a code, a message and the numbers the error carries."""
    if isinstance(error, WorldChanged):
        return NodeFailure(error.reason.node, str(error), error.reason)
    if isinstance(error, KeyboardInterrupt):
        code, text = "interrupted", "stopped by the operator"
    elif isinstance(error, Preempted):
        code, text = "preempted", str(error)
    elif isinstance(error, SkillHung):
        code, text = "skill_hung", str(error)
    elif isinstance(error, GuardTripped):
        code, text = f"guard_{error.guard}", str(error)
    elif isinstance(error, BackendError):
        code, text = re.sub("(?<!^)(?=[A-Z])", "_", type(error).__name__).lower(), str(error)
    else:
        code, text = "fault", f"{type(error).__name__}: {error}{_place(error)}"
    return NodeFailure(node, text, Reason(code, text, _evidence(error), node=node))


def _place(error: BaseException) -> str:
    """Return the file and line of the innermost code outside this package that the error passed, such as a skill."""
    frames = traceback.extract_tb(error.__traceback__)
    outside = [f for f in frames if "glotouch_bt" not in Path(f.filename).parts and "site-packages" not in f.filename]
    return f" ({Path(outside[-1].filename).name}:{outside[-1].lineno}; --debug shows the traceback)" if outside else ""


def _evidence(error: BaseException) -> dict[str, float | int | str | bool]:
    """Return the values a backend error carries, by name."""
    if not isinstance(error, BackendError):
        return {}
    names = ("guard", "quantity", "value", "limit", "stamp_s", "age_s", "max_age_s")
    return {name: value for name in names if isinstance(value := getattr(error, name, None), (float, int, str))}
