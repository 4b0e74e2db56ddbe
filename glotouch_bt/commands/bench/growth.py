"""`glotouch bench growth`: explorations of more objects in larger boxes."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def growth(
    trials: Annotated[int, typer.Option(min=1, help="layouts of each number of objects and area")] = 10,
    seed: shared.FirstSeed = 0,
    policy: Annotated[str, typer.Option(help="search policy")] = "expected_find",
    objects: shared.Objects = None,
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Growth: travel and planning time of a search against the number of objects and the area of the box.

    On the planar model of the exploration, with the mission's objects repeated.
    """
    from glotouch_bt.bench.planar import GrowthCampaign, run_growth
    from glotouch_bt.commands.terminal import print_growth

    campaign = GrowthCampaign(
        seeds=tuple(range(seed, seed + trials)),
        policy=policy,
        objects=objects,
        out=shared.bench_folder(out, "growth"),
        resume=resume,
        shard=shared.read_shard(shard),
    )

    def describe_row(row: dict[str, Any]) -> str:
        where = f"{row['objects']} objects, {row['area']:g} areas, seed {row['seed']}"
        return f"{where}: {row['found']} found, {row['travel_m']:.2f} m, {row['cause'] or row['ended']}"

    executors = shared.Executors(workers, cluster, trial_limit)
    summary = shared.run_in_pool(run_growth, campaign, executors, describe_row)
    shared.print_summary(summary, campaign.out, print_growth, json_)
