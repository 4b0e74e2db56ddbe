"""Run many trials and count their classes; keep the inputs of bad ones."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.bench import wilson
from glotouch_bt.runs import OnRow, Task, gather, silent, write_summary
from glotouch_bt.validation.fuzz.kind import BAD, FuzzKind
from glotouch_bt.validation.fuzz.meshes import MeshKind
from glotouch_bt.validation.fuzz.missions import MissionKind
from glotouch_bt.validation.fuzz.runs import RunKind
from glotouch_bt.validation.fuzz.trial import MAX_DURATION_S, Result, run_trials, stream_of

KINDS: dict[str, FuzzKind] = {kind.name: kind for kind in (MissionKind(), MeshKind(), RunKind())}
"""Every kind by its name; a new kind is registered here."""
CHUNK = 50
"""Trials of one task."""


@dataclass(frozen=True)
class FuzzCampaign:
    """Settings of the campaign.

    Attributes:
        trials: Number of inputs.
        seed: Seed of all inputs; trial n does not depend on their number.
        out: Folder for summary.json and the inputs of bad trials.
        kind: Name of the kind of input.
    """

    trials: int
    seed: int
    out: Path
    kind: str = "missions"


def run_campaign(campaign: FuzzCampaign, executor: Executor, on_counts: OnRow = silent) -> dict[str, Any]:
    """Run every trial in processes, write summary.json and failures/, and return the summary.

    The trials of a process that died are run again one by one, which shows the one that ends it. `on_counts` is called
    with (counts so far, trials done, total) after each chunk.
    """
    campaign.out.mkdir(parents=True, exist_ok=True)
    kind = KINDS[campaign.kind]
    counts: Counter[tuple[str, str]] = Counter()
    bad: list[Result] = []
    again: list[int] = []

    def count(results: list[Result], *_: int) -> None:
        if len(results) > 1 and results[0].came == "process died":
            again.extend(r.number for r in results)
            return
        for result in results:
            counts[result.sort, result.came] += 1
            if result.came in BAD:
                bad.append(result)
                _keep(campaign, kind, result)
        on_counts(_by_class(counts), counts.total(), campaign.trials)

    def tasks(chunks: Sequence[Sequence[int]]) -> list[Task[list[Result]]]:
        seed = campaign.seed
        return [Task(partial(run_trials, kind, seed, tuple(c)), partial(_died, tuple(c))) for c in chunks]

    chunks = [range(k, min(k + CHUNK, campaign.trials)) for k in range(0, campaign.trials, CHUNK)]
    gather(executor, tasks(chunks), count)
    gather(executor, tasks([[n] for n in again]), count)
    sorts = sorted({sort for sort, _ in counts})
    summary = {
        "kind": campaign.kind,
        "trials": campaign.trials,
        "seed": campaign.seed,
        "longest_s": MAX_DURATION_S,
        "counts": {sort: {c: n for (s, c), n in sorted(counts.items()) if s == sort} for sort in sorts},
        "bad": wilson(len(bad), campaign.trials),
        "failures": [{"trial": r.number, "sort": r.sort, "came": r.came, "detail": r.detail} for r in bad],
    }
    write_summary(campaign.out, summary)
    return summary


def _died(numbers: Sequence[int], error: Exception) -> list[Result]:
    return [Result(n, "unknown", "process died", str(error)) for n in numbers]


def _by_class(counts: Counter[tuple[str, str]]) -> dict[str, int]:
    found: Counter[str] = Counter()
    for (_, came), n in counts.items():
        found[came] += n
    return dict(found)


def _keep(campaign: FuzzCampaign, kind: FuzzKind, result: Result) -> None:
    """Make the input of a bad trial again, for people."""
    folder = campaign.out / "failures" / f"{result.came.replace(' ', '_')}-{result.number}"
    folder.mkdir(parents=True, exist_ok=True)
    kind.make(stream_of(campaign.seed, result.number), folder)
    (folder / "detail.txt").write_text(result.detail, encoding="utf-8", errors="backslashreplace")
