"""The file that a finished trial of a campaign leaves in its folder: its request and its row of results."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from glotouch_bt.escaped_text import json_text
from glotouch_bt.faults import FaultPlan, read_plan
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import to_json
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import stl_files
from glotouch_bt.runs.folder import RunFolder
from glotouch_bt.runs.request import RunRequest
from glotouch_bt.runs.result import installed_versions
from glotouch_bt.untrusted import read_json

TRIAL = "trial.json"
"""Name of the file."""


@dataclass(frozen=True)
class TrialMemory:
    """The row of a finished trial, in the trial's folder.

    Attributes:
        request: The trial's request with its folder.
        also: Further settings of the trial that its row depends on, as JSON data.
    """

    request: RunRequest
    also: Mapping[str, Any] = field(default_factory=dict)

    def read(self) -> dict[str, Any] | None:
        """Return the row of a finished trial of this request, or None.

        Raises:
            BadInput: The folder holds a trial of another request; the message names the differences.
        """
        path = self._folder / TRIAL
        if not os.path.lexists(path):
            return None
        kept = read_json(path)
        if not isinstance(kept, dict) or not all(isinstance(kept.get(k), dict) for k in ("request", "row")):
            raise BadInput(f"{path}: is not a trial of a campaign; remove it to run this trial again")
        there: dict[str, Any] = kept["request"]
        row: dict[str, Any] = kept["row"]
        asked = self._asked()
        if there != asked:
            raise BadInput(
                f"{self._folder}: holds a trial that was made otherwise: {_difference(there, asked)}; "
                "continue with the same options, or give another folder"
            )
        return row

    def write(self, row: Mapping[str, Any]) -> None:
        """Remember the row."""
        RunFolder(self._folder).write_text(TRIAL, json_text({"request": self._asked(), "row": row}))

    def forget(self) -> None:
        """Forget an earlier trial in this folder."""
        (self._folder / TRIAL).unlink(missing_ok=True)

    @property
    def _folder(self) -> Path:
        assert self.request.out is not None
        return self.request.out

    def _asked(self) -> dict[str, Any]:
        asked = described_request(self.request) | dict(self.also)
        plain: dict[str, Any] = json.loads(json_text(asked))
        return plain


def described_request(request: RunRequest) -> dict[str, Any]:
    """Return all that the result of a run depends on, as JSON data; files by the digest of their content."""
    settings = tuple(sorted(request.settings.items()))
    return {
        "mission": request.mission,
        "backend": request.backend,
        "seed": request.seed,
        "settings": dict(settings),
        "conditions": request.conditions,
        "faults": _described_plan(request),
        "content": _content(
            request.mission, settings, request.objects, request.world, request.conditions, request.allow_paths
        ),
        "versions": installed_versions(),
    }


@lru_cache(maxsize=256)
def _content(
    mission: str,
    settings: tuple[tuple[str, str], ...],
    objects: Path | None,
    other_world: str | None,
    conditions: str,
    allow_paths: tuple[Path, ...],
) -> dict[str, str]:
    """Return the digests of the mission with its world, of each object, and of the conditions."""
    loaded = load_mission(mission, dict(settings), objects=objects, world=other_world, allow_paths=allow_paths)
    chosen = loaded.world.objects
    world = replace(loaded.world, objects=replace(chosen, folder=Path()))
    parts: dict[str, Any] = {
        "mission": {k: v for k, v in loaded.document.items() if k != "world"},
        "world": to_json(world),
        "conditions": asdict(load_conditions(conditions)),
    }
    found = {name: _digest(json.dumps(part, sort_keys=True).encode()) for name, part in parts.items()}
    files = stl_files(chosen.folder)
    return found | {f"object {n}": _digest(files[n].read_bytes()) for n in chosen.names or files}


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def _described_plan(request: RunRequest) -> Any:
    plan = request.faults
    if plan is None:
        return None
    if not isinstance(plan, FaultPlan):
        plan = read_plan(plan)
    return {"seed": plan.seed, "faults": [{"fault": f.kind.name, **f.requested()} for f in plan.faults]}


def _difference(there: Mapping[str, Any], asked: Mapping[str, Any], within: str = "") -> str:
    """Return the keys in which two descriptions differ, with both values, in words."""
    words = []
    for key in sorted({*there, *asked}):
        one, two = there.get(key), asked.get(key)
        if one == two:
            continue
        if isinstance(one, dict) and isinstance(two, dict):
            words.append(_difference(one, two, f"{key}: " if key != "content" else "content of "))
        else:
            words.append(f"{within}{key} {_short(one)}, now {_short(two)}")
    return "; ".join(words)


def _short(value: object) -> str:
    text = "none" if value is None else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
