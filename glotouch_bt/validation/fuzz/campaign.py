"""Run many trials and count their classes; keep the documents of bad ones."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.bench import wilson
from glotouch_bt.runs import OnRow, gather, silent, write_summary
from glotouch_bt.validation.fuzz.trial import BAD, MAX_DURATION_S, Result, run_trials

CHUNK = 50


@dataclass(frozen=True)
class FuzzCampaign:
    """Settings of the campaign.

    Attributes:
        trials: Number of documents.
        seed: Seed of all documents; trial n does not depend on their number.
        out: Folder for summary.json and the documents of bad trials.
    """

    trials: int
    seed: int
    out: Path


def run_campaign(campaign: FuzzCampaign, executor: Executor, on_counts: OnRow = silent) -> dict[str, Any]:
    """Run every trial in processes, write summary.json and failures/, and return the summary.

    `on_counts` is called with (counts so far, trials done, total) after each chunk.
    """
    campaign.out.mkdir(parents=True, exist_ok=True)
    counts: Counter[tuple[str, str]] = Counter()
    bad: list[Result] = []
    chunks = [range(k, min(k + CHUNK, campaign.trials)) for k in range(0, campaign.trials, CHUNK)]

    def count(results: list[Result], *_: int) -> None:
        for result in results:
            counts[result.kind, result.came] += 1
            if result.came in BAD:
                bad.append(result)
                _keep(campaign.out, result)
        on_counts(_by_class(counts), counts.total(), campaign.trials)

    gather([executor.submit(run_trials, campaign.seed, tuple(c)) for c in chunks], count)
    summary = {
        "trials": campaign.trials,
        "seed": campaign.seed,
        "longest_s": MAX_DURATION_S,
        "counts": {kind: {c: n for (k, c), n in sorted(counts.items()) if k == kind} for kind in _kinds(counts)},
        "bad": wilson(len(bad), campaign.trials),
        "failures": [{"trial": r.number, "kind": r.kind, "came": r.came, "detail": r.detail} for r in bad],
    }
    write_summary(campaign.out, summary)
    return summary


def _kinds(counts: Counter[tuple[str, str]]) -> list[str]:
    return sorted({kind for kind, _ in counts})


def _by_class(counts: Counter[tuple[str, str]]) -> dict[str, int]:
    found: Counter[str] = Counter()
    for (_, came), n in counts.items():
        found[came] += n
    return dict(found)


def _keep(out: Path, result: Result) -> None:
    folder = out / "failures"
    folder.mkdir(exist_ok=True)
    name = f"{result.came.replace(' ', '_')}-{result.number}"
    (folder / f"{name}.yaml").write_bytes(result.text)
    (folder / f"{name}.txt").write_text(result.detail, encoding="utf-8", errors="backslashreplace")
