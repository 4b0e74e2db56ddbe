"""The finished trials of a campaign's folder as plain values, whatever bench wrote them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import MANIFEST, TRIAL, TrialFolder
from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import read_json

GROUPED_BY = ("simulator", "policy", "method", "kind", "axis", "level")
"""Columns whose values are compared apart: a rate over several methods says nothing."""
LABELS = ("seed", "exit_code", "best", "twin", "objects", "number", "index", "joint", *GROUPED_BY)
"""Columns that name a trial or its parts, and measure nothing."""
BUDGETS_M = (1.0, 3.0, 5.0)
"""Travel at which discovered objects are counted."""


@dataclass(frozen=True)
class Measured:
    """One trial, or one decision of a trial.

    Attributes:
        world: What it shares with the trials that are not independent of it: the seed, which draws the layout.
        group: Label of what is compared together, such as a matcher's name.
        rates: Yes or no, by column.
        numbers: Finite numbers, by column.
    """

    world: str
    group: str
    rates: Mapping[str, bool]
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class Recorded:
    """A campaign's folder.

    Attributes:
        folder: Its path.
        identity: Code, versions, settings and objects of all its trials.
        commit: Commit of its summary, or None.
        trials: Measured values by name; the same name in two folders is the same seed, target, policy and so on.
    """

    folder: Path
    identity: Mapping[str, Any]
    commit: str | None
    trials: Mapping[str, Measured]


def read_campaign(folder: Path) -> Recorded:
    """Read all finished trials below a campaign's folder; the campaign itself need not be finished.

    Raises:
        BadInput: It is not a campaign's folder, holds no finished trial, or a file cannot be read.
    """
    if not (folder / MANIFEST).is_file():
        raise BadInput(f"{folder}: is not the folder of a campaign (it has no {MANIFEST}); give the --out of a bench")
    identity = read_json(folder / MANIFEST)
    if not isinstance(identity, dict):
        raise BadInput(f"{folder / MANIFEST}: cannot be read")
    trials: dict[str, Measured] = {}
    for path in sorted(folder.rglob(TRIAL)):
        name = str(path.parent.relative_to(folder))
        made, row = TrialFolder(path.parent).kept()
        seed = row.get("seed", made.get("seed", name))
        trials |= {" ".join(filter(None, (name, more))): m for more, m in _measured(row, seed)}
    if not trials:
        raise BadInput(f"{folder}: holds no finished trial")
    summary = read_json(folder / "summary.json") if (folder / "summary.json").is_file() else {}
    return Recorded(folder, identity, summary.get("commit") if isinstance(summary, dict) else None, trials)


def _measured(row: Mapping[str, Any], seed: Any) -> Iterator[tuple[str, Measured]]:
    """Yield (name within the trial, values): the trial itself, and each decision of a trial that made several."""
    decisions = row.get("trials")
    if not isinstance(decisions, list):
        yield "", _values(row, seed)
        return
    layout = row.get("layout", {})
    for n, decision in enumerate(decisions):
        name = " ".join(str(decision[k]) for k in ("method", "kind", "target") if k in decision) or str(n)
        yield name, _values(decision, layout.get("seed", seed))
    yield "layout", _values({"kind": "layout", **layout}, layout.get("seed", seed))


def _values(row: Mapping[str, Any], seed: Any) -> Measured:
    rates = {k: v for k, v in row.items() if isinstance(v, bool) and k not in LABELS}
    numbers = {
        k: float(v)
        for k, v in row.items()
        if isinstance(v, int | float) and not isinstance(v, bool) and k not in LABELS and math.isfinite(v)
    }
    if "status" in row:
        rates.pop("correct", None)  # unknown for an aborted mission, which is no success
        rates["success"] = row["status"] == "success" and row.get("correct") is not False
    if "retrieved" in row:
        rates["wrong_object"] = bool(row["retrieved"]) and not row.get("correct")
    if "exit_code" in row:
        rates["safety_stop"] = row["exit_code"] == 3
    if isinstance(found := row.get("discovered_m"), list):
        numbers |= {f"found_at_{d:g}_m": float(sum(t <= d for t in found)) for d in BUDGETS_M}
    group = " ".join(str(row[k]) for k in GROUPED_BY if row.get(k) not in (None, ""))
    return Measured(str(seed), group, rates, numbers)
