"""Run many trials and count their classes; keep the inputs of bad ones."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.bench import wilson
from glotouch_bt.campaign import (
    OnRow,
    Row,
    Shard,
    Trial,
    described_code,
    open_folder,
    plain,
    run_trials,
    silent,
    write_summary,
)
from glotouch_bt.validation.fuzz.kind import BAD, FuzzKind
from glotouch_bt.validation.fuzz.meshes import MeshKind
from glotouch_bt.validation.fuzz.missions import MissionKind
from glotouch_bt.validation.fuzz.runs import RunKind
from glotouch_bt.validation.fuzz.trial import MAX_DURATION_S, Result, run_inputs, stream_of

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
        resume, shard: As in `Campaign`.
    """

    trials: int
    seed: int
    out: Path
    kind: str = "missions"
    resume: bool = False
    shard: Shard | None = None

    @property
    def identity(self) -> dict[str, Any]:
        """Settings that all trials share."""
        return {"campaign": "FuzzCampaign", "kind": self.kind, "seed": self.seed, **described_code()}

    def open(self) -> None:
        """See `Campaign`."""
        open_folder(self.out, self.identity, keep=self.resume or self.shard is not None)

    def trial(self, numbers: Sequence[int]) -> Trial:
        """Return the trial that tries some inputs in turn."""
        given = tuple(numbers)
        name = f"{given[0]}-{given[-1]}"
        run, died = partial(_tried, self.kind, self.seed, given), partial(_died, given)
        return Trial(self.out / "inputs" / name, plain(self.identity | {"numbers": given}), run, died)


def run_campaign(campaign: FuzzCampaign, executor: Executor, on_counts: OnRow = silent) -> dict[str, Any]:
    """Run every trial in processes, write summary.json and failures/, and return the summary.

    The trials of a process that died are run again one by one, which shows the one that ends it. `on_counts` is called
    with (counts so far, trials done, total) after each chunk.
    """
    campaign.out.mkdir(parents=True, exist_ok=True)
    kind = KINDS[campaign.kind]
    counts: Counter[tuple[str, str]] = Counter()

    def show(row: Row, *_: int) -> None:
        counts.update((r["sort"], r["came"]) for r in row["results"])
        on_counts(_by_class(counts), counts.total(), campaign.trials)

    chunks = [range(k, min(k + CHUNK, campaign.trials)) for k in range(0, campaign.trials, CHUNK)]
    rows = run_trials(executor, [campaign.trial(c) for c in chunks], campaign, show)
    lost = [r["number"] for row in rows if _lost(row) for r in row["results"]]
    rows = [row for row in rows if not _lost(row)]
    counts = Counter((r["sort"], r["came"]) for row in rows for r in row["results"])
    rows += run_trials(executor, [campaign.trial([n]) for n in lost], campaign, show, before=len(chunks))
    results = [Result(**r) for row in rows for r in row["results"]]
    counts = Counter((r.sort, r.came) for r in results)
    bad = [r for r in results if r.came in BAD]
    for result in bad:
        _keep(campaign, kind, result)
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
    return write_summary(campaign.out, summary)


def _tried(kind: str, seed: int, numbers: Sequence[int]) -> Row:
    return {"results": [asdict(r) for r in run_inputs(KINDS[kind], seed, numbers)]}


def _died(numbers: Sequence[int], error: Exception) -> Row:
    return {"results": [asdict(Result(n, "unknown", "process died", str(error))) for n in numbers]}


def _lost(row: Row) -> bool:
    """Return True for several inputs whose process died: which of them ended it is not known."""
    return len(row["results"]) > 1 and row["results"][0]["came"] == "process died"


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
