"""`glotouch bench fuzz`: random and corrupt inputs."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def fuzz(
    kind: Annotated[str, typer.Option(help="what is fuzzed: missions (with fault plans), meshes or runs")] = "missions",
    trials: Annotated[int, typer.Option(min=1, help="number of inputs")] = 20_000,
    seed: shared.FirstSeed = 0,
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> int:
    """Random and corrupt inputs: nothing may crash, hang, run code or accept a mistake."""
    from glotouch_bt.robot import UnknownName
    from glotouch_bt.validation.fuzz import BAD, KINDS, FuzzCampaign, run_campaign

    if kind not in KINDS:
        raise UnknownName("kind of input", kind, KINDS)
    campaign = FuzzCampaign(trials, seed, shared.bench_folder(out, "fuzz"), kind, resume, shared.read_shard(shard))

    def describe_row(counts: Mapping[str, int]) -> str:
        return f"{sum(counts.get(name, 0) for name in BAD)} bad"

    summary = shared.run_in_pool(run_campaign, campaign, shared.Executors(workers, cluster, trial_limit), describe_row)
    shared.print_summary(summary, campaign.out, _print_fuzz, json_)
    return 1 if summary["failures"] else 0


def _print_fuzz(summary: Mapping[str, Any], out: Path) -> None:
    from glotouch_bt.commands.terminal import print_table

    sorts = list(summary["counts"])
    classes = sorted({c for found in summary["counts"].values() for c in found})
    rows = [(c, *(str(summary["counts"][k].get(c, 0)) for k in sorts)) for c in classes]
    print_table(f"{summary['trials']} {summary['kind']}, seed {summary['seed']}", ("outcome", *sorts), rows)
    bad = summary["bad"]
    sys.stdout.write(f"bad: {len(summary['failures'])} ({100 * bad['lo']:.3f} .. {100 * bad['hi']:.3f} %)\n")
    sys.stdout.write(f"{out / 'summary.json'}\n")
