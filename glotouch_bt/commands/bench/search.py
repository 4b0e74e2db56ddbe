"""`glotouch bench search`: travel until every object is found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def search(
    policies: Annotated[str, typer.Option(help="search policies, comma-separated; the report is on the first")] = (
        "expected_find,nearest_frontier,random_descent"
    ),
    trials: Annotated[int, typer.Option(min=0, help="missions per policy, each with its own layout")] = 100,
    planar: Annotated[int, typer.Option(min=0, help="layouts explored in the planar model only")] = 0,
    seed: shared.FirstSeed = 0,
    conditions: shared.Conditions = "nominal",
    objects: shared.Objects = None,
    backend: shared.Backend = "mujoco",
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    resume: shared.KeepTrials = False,
    recorded: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="also score the runs recorded below this folder, without running them again"),
    ] = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Search: travel until every object is found, for each policy.

    On the mission, and on a planar model of it with the same and more layouts.
    """
    from glotouch_bt.bench.search import SearchCampaign, run_campaign
    from glotouch_bt.commands.terminal import print_search

    shared.check_names(conditions, backend)
    campaign = SearchCampaign(
        policies=tuple(p.strip() for p in policies.split(",") if p.strip()),
        seeds=tuple(range(seed, seed + trials)),
        planar_seeds=tuple(range(seed, seed + planar)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=shared.bench_folder(out, "search"),
        resume=resume,
        shard=shared.read_shard(shard),
        recorded=tuple(recorded or ()),
    )

    def told(row: dict[str, Any]) -> str:
        found = f"{len(row['discovered_m'])} found, {row['travel_m']:.2f} m, {row['ended']}"
        return f"{row['simulator']} {row['policy']} seed {row['seed']}: {found}"

    summary = shared.run_in_pool(run_campaign, campaign, shared.Executors(workers, cluster, trial_limit), told)
    shared.print_summary(summary, campaign.out, print_search, json_)
