"""All decisions on one recorded layout as rows: present targets, absent targets, strangers, and all pairs."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from glotouch_bt.bench.match.dataset import Layout, Planar, Touched
from glotouch_bt.bench.match.methods import TOUCHED, Method, Target, by_touch, methods
from glotouch_bt.bench.match.shapes import symmetries_rad, twins
from glotouch_bt.perception import model_with_sides
from glotouch_bt.perception.recognition import (
    Match,
    PadSpec,
    Ranking,
    TargetModel,
    TouchedObject,
    encounter_of,
    touched_model,
)
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import Mesh, load_folder

TRIAL_COLUMNS = (
    "method", "kind", "seed", "target", "twin", "candidates", "best", "best_object", "right", "accepted", "p_best",
    "p_absent", "best_loss", "margin", "evidence", "position_error_mm", "yaw_error_deg", "ms_per_pair", "reasons",
)  # fmt: skip
PAIR_COLUMNS = ("method", "seed", "target", "stranger", "candidate", "object", "loss", "probability", "evidence")


@dataclass(frozen=True)
class Decided:
    """The rows of one layout.

    Attributes:
        trials: One row a decision, `TRIAL_COLUMNS`.
        pairs: One row an (STL, TouchSet) pair of the full box, `PAIR_COLUMNS`.
    """

    trials: list[dict[str, Any]]
    pairs: list[dict[str, Any]]


@lru_cache(maxsize=4)
def meshes_of(folder: Path) -> dict[str, Mesh]:
    """Return the usable STLs of a folder by name.

    Raises:
        BadInput: None, or an unusable one.
    """
    return {m.name: m for m in load_folder(folder)}


def models_of(layout: Layout, folder: Path, names: Sequence[str] = ()) -> dict[str, TargetModel]:
    """Return models of `names` (default: the objects in the box) for the pads that touched the layout.

    Raises:
        BadInput: The folder has no STL of that name.
    """
    meshes = meshes_of(folder)
    missing = [n for n in names or layout.objects if n not in meshes]
    if missing:
        raise BadInput(f"{folder}: has no {', '.join(missing)} (it has {', '.join(meshes)})")
    return {n: model_with_sides(meshes[n], pad_of(layout), "upright") for n in names or layout.objects}


def pad_of(layout: Layout) -> PadSpec:
    """Return the pads that touched a layout."""
    for t in layout.touched:
        for layer in t.touchset.layers:
            rows, columns = layer.left_m.shape
            return PadSpec(shape=(rows, columns))
    return PadSpec()


def decide(
    layout: Layout,
    objects: Path,
    strangers: Path | None,
    names: Sequence[str],
    handled: Mapping[str, TouchSet] = MappingProxyType({}),
) -> Decided:
    """Make every decision of a layout with every method.

    Present: a touched object's STL against all TouchSets. Absent: the same without its own TouchSets.
    Untouched: the STL of an object in the box that was never squeezed. Stranger: the STL of an object outside it.
    A target with a twin in the box is marked. The method `TOUCHED` knows a target by its TouchSet in `handled` only.

    Raises:
        BadInput: An STL is missing or unusable.
    """
    out = Decided([], [])
    if not layout.touched:
        return out
    made = {**methods(), TOUCHED: by_touch}
    present = models_of(layout, objects)
    meshes = {n: meshes_of(objects)[n] for n in present}
    twin = {n: any(twins(m, other) for k, other in meshes.items() if k != n) for n, m in meshes.items()}
    known = {m.digest for m in meshes_of(objects).values()}
    strange = {} if strangers is None else {n: m for n, m in meshes_of(strangers).items() if m.digest not in known}
    foreign = {} if strangers is None or not strange else models_of(layout, strangers, tuple(strange))
    pad = pad_of(layout)
    felt = {n: touched_model(TouchedObject(n, (encounter_of(t, pad),)), pad) for n, t in handled.items()}
    for name in names:
        method = made[name]
        for target, model in present.items():
            mine = layout.of(target)
            others = [t for i, t in enumerate(layout.touched) if i not in mine]
            head = {"method": name, "seed": layout.seed, "target": target, "twin": twin[target]}
            mesh = meshes[target] if mine else None
            shown = Target(meshes[target], model, felt.get(target))
            row, ranking = _trial(method, shown, layout.touched, target, mesh)
            out.trials.append(head | {"kind": "present" if mine else "untouched"} | row)
            out.pairs.extend(_pairs(head | {"stranger": False}, layout, ranking))
            if mine and others:
                row, _ = _trial(method, shown, others, target)
                out.trials.append(head | {"kind": "absent"} | row)
        for target, model in foreign.items():
            head = {"method": name, "seed": layout.seed, "target": target, "twin": False}
            row, ranking = _trial(method, Target(strange[target], model), layout.touched, target)
            out.trials.append(head | {"kind": "stranger"} | row)
            out.pairs.extend(_pairs(head | {"stranger": True}, layout, ranking))
    return out


def _trial(
    method: Method, shown: Target, touched: Sequence[Touched], target: str, mesh: Mesh | None = None
) -> tuple[dict[str, Any], Ranking]:
    """Make one decision; `mesh` is the target's if it is in `touched` (a stranger may share an object's name)."""
    began = time.perf_counter()
    ranking = method(shown, [t.touchset for t in touched])
    took = time.perf_counter() - began
    by_index = {t.touchset.candidate.index: t for t in touched}
    best = ranking.best
    found = by_index[best.index]
    right = mesh is not None and found.name == target
    row: dict[str, Any] = {
        "candidates": len(touched), "best": best.index, "best_object": found.name, "right": right,
        "accepted": bool(ranking.accepted), "p_best": best.probability, "p_absent": ranking.p_absent,
        "best_loss": best.loss, "evidence": best.evidence, "ms_per_pair": 1e3 * took / len(touched),
        "reasons": "; ".join(ranking.reasons), "margin": math.nan, "position_error_mm": math.nan,
        "yaw_error_deg": math.nan,
    }  # fmt: skip
    if mesh is not None:
        row["margin"] = signed_margin(ranking, {i for i, t in by_index.items() if t.name == target})
        mine = [m for m in ranking.matches if by_index[m.index].name == target]
        row |= pose_errors(mine[0], by_index[mine[0].index].pose_K_O, mesh)
    return row, ranking


def signed_margin(ranking: Ranking, mine: set[int]) -> float:
    """Return the lowest loss of the wrong candidates minus that of the right ones: positive if the right one leads.

    NaN if there are no wrong ones, or if neither side has a finite loss.
    """
    right = min((m.loss for m in ranking.matches if m.index in mine), default=math.inf)
    wrong = min((m.loss for m in ranking.matches if m.index not in mine), default=math.nan)
    return math.nan if math.isinf(right) and math.isinf(wrong) else wrong - right


def _pairs(head: Mapping[str, Any], layout: Layout, ranking: Ranking) -> list[dict[str, Any]]:
    names = {t.touchset.candidate.index: t.name for t in layout.touched}
    return [
        dict(head)
        | {"candidate": m.index, "object": names[m.index], "loss": m.loss, "probability": m.probability}
        | {"evidence": m.evidence}
        for m in sorted(ranking.matches, key=lambda m: m.index)
    ]


def pose_errors(match: Match, truth: Planar | None, mesh: Mesh) -> dict[str, float]:
    """Return the position and yaw errors of a fitted pose, up to the mesh's own symmetry.

    Positions are compared at the mesh origin, the centre of its bounding box. The yaw error of a solid of revolution is
    always 0.
    """
    if truth is None or not all(math.isfinite(v) for v in match.pose_K_O):
        return {"position_error_mm": math.nan, "yaw_error_deg": math.nan}
    x, y, yaw = match.pose_K_O
    off = (yaw - truth[2] - symmetries_rad(mesh) + math.pi) % (2 * math.pi) - math.pi
    return {
        "position_error_mm": 1e3 * math.hypot(x - truth[0], y - truth[1]),
        "yaw_error_deg": float(np.rad2deg(np.abs(off).min())),
    }
