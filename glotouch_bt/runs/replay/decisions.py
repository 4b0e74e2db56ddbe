"""Repeat the recognition decisions of a run from its recorded TouchSets, each on its own.

This shows what the present matcher decides on recorded data, also of older versions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.perception import model_for
from glotouch_bt.perception.recognition import MATCHERS, Ranking
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.report import RunRecord, read_run
from glotouch_bt.robot import BadInput, GlotouchError, Gripper
from glotouch_bt.robot.scene import load_folder
from glotouch_bt.runs.folder import require_run_folder
from glotouch_bt.runs.replay.run import replayed_robot, unfit_as_bad_input


@dataclass(frozen=True)
class Decision:
    """One decision, then and now.

    Attributes:
        stamp_s: Robot clock.
        target: Name of the target object.
        matcher: Name of the matcher.
        then: As recorded: {matches: [{index, probability, ...}], accepted, reasons, ...}.
        now: Ranking of the same TouchSets by the present code.
    """

    stamp_s: float
    target: str
    matcher: str
    then: dict[str, Any]
    now: Ranking

    @property
    def same(self) -> bool:
        """True if the best candidate and its acceptance agree."""
        first = self.then["matches"][0]["index"] if self.then.get("matches") else None
        return first == self.now.best.index and bool(self.then.get("accepted")) == self.now.accepted

    def __str__(self) -> str:
        matches = self.then.get("matches") or [{"index": "none", "probability": None}]
        was, is_ = matches[0], self.now.best
        then = _words(was["index"], was.get("probability"), bool(self.then.get("accepted")), self.then.get("reasons"))
        now = _words(is_.index, is_.probability, self.now.accepted, self.now.reasons)
        head = f"t={self.stamp_s:.2f} s {self.target}"
        return f"{head}: the same: {now}" if self.same else f"{head}: then {then}; now {now}"


def replay_decisions(folder: Path, *, objects: Path | None = None) -> list[Decision]:
    """Repeat each decision of a run on the TouchSets recorded before it.

    Args:
        folder: The run's folder.
        objects: Folder of its STL files, if they have moved.

    Raises:
        BadInput: There is no run, its mission cannot be loaded, or its record is of an unknown version.
    """
    require_run_folder(folder)
    record = read_run(folder)
    mission = load_mission(record.path.parent / "mission.yaml", objects=objects)
    gripper = replayed_robot(record).description.gripper
    with unfit_as_bad_input(record):
        return list(_decisions(record, mission, gripper))


def _decisions(record: RunRecord, mission: Mission, gripper: Gripper) -> Iterator[Decision]:
    felt: dict[int, TouchSet] = {}
    for event in record.events:
        if event.kind == "touchset":
            touchset = _touchset(event.data.get("touchset"), record)
            felt[touchset.candidate.index] = touchset  # the newest holds all layers
        elif event.kind == "ranking":
            target, matcher = str(event.data["target"]), str(event.data.get("matcher", "likelihood"))
            then = event.data["ranking"]
            known = [m["index"] for m in then.get("matches", [])]
            given = tuple(felt[i] for i in felt if i in known)
            if not given or matcher not in MATCHERS:
                continue
            objects = mission.world.objects
            model = model_for(load_folder(objects.folder, (target,))[0], gripper, objects.stance)
            yield Decision(event.stamp_s, target, matcher, then, MATCHERS[matcher](model, given))


def _touchset(data: object, record: RunRecord) -> TouchSet:
    try:
        return msgspec.convert(_finite(data), TouchSet, dec_hook=_array, strict=False)
    except (msgspec.ValidationError, GlotouchError, ValueError) as e:
        raise BadInput(f"{record.path}: it holds a TouchSet of an unknown version ({e})") from e


def _finite(data: Any) -> Any:
    """Replace null by NaN, which JSON cannot hold."""
    if isinstance(data, dict):
        return {k: _finite(v) for k, v in data.items()}
    if isinstance(data, list):
        return [_finite(v) for v in data]
    return float("nan") if data is None else data


def _array(_: object, value: Any) -> np.ndarray[Any, Any]:
    array = np.asarray(value, dtype=np.float64)
    return array if array.size else array.reshape(0, 0)


def _words(index: object, probability: float | None, accepted: bool, reasons: Any) -> str:
    p = "" if probability is None else f", P {probability:.3f}"
    verdict = "accepted" if accepted else f"not accepted ({'; '.join(reasons or ())})"
    return f"candidate {index}{p}, {verdict}"
