"""`glotouch bench search`: travel until every object is found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from glotouch_bt.commands import shared


@shared.guarded
def search(
    policies: Annotated[str, typer.Option(help="search policies, comma-separated; the report is on the first")] = (
        "expected_find,nearest_frontier,random_descent"
    ),
    trials: Annotated[int, typer.Option(min=0, help="missions per policy, each with its own layout")] = 100,
    planar: Annotated[int, typer.Option(min=0, help="layouts explored in the planar model only")] = 0,
    count: Annotated[
        Literal["known", "unknown"],
        typer.Option(
            help="unknown: is the stated chance that something is left right? On --planar layouts of 1 to 8 "
            "random objects, in the planar model only, with the first policy"
        ),
    ] = "known",
    seed: shared.FirstSeed = 0,
    conditions: shared.Conditions = "nominal",
    objects: shared.Objects = None,
    world: shared.WorldName = None,
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
    from glotouch_bt.bench.search import CountCampaign, SearchCampaign, run_campaign, run_count_campaign
    from glotouch_bt.commands.terminal import print_counts, print_search
    from glotouch_bt.robot import BadInput

    shared.check_names(conditions, backend)
    names = tuple(p.strip() for p in policies.split(",") if p.strip())
    executors = shared.Executors(workers, cluster, trial_limit)
    if count == "unknown":
        if objects is not None or recorded or conditions != "nominal" or world is not None:
            raise BadInput(
                "--count unknown makes objects of its own: omit --objects, --world, --recorded and --conditions"
            )
        counting = CountCampaign(
            policy=names[0] if names else "",
            seeds=tuple(range(seed, seed + planar)),
            out=shared.bench_folder(out, "search"),
            resume=resume,
            shard=shared.read_shard(shard),
        )

        def said(row: dict[str, Any]) -> str:
            known, unknown = (f"{row[c]['right']} in {row[c]['travel_m']:.2f} m" for c in ("known", "unknown"))
            return f"seed {row['seed']}: {row['objects']} objects; known number: {known}; unknown: {unknown}"

        figures = shared.run_in_pool(run_count_campaign, counting, executors, said)
        shared.print_summary(figures, counting.out, print_counts, json_)
        return
    campaign = SearchCampaign(
        policies=names,
        seeds=tuple(range(seed, seed + trials)),
        planar_seeds=tuple(range(seed, seed + planar)),
        conditions=conditions,
        objects=objects,
        world=world,
        backend=backend,
        out=shared.bench_folder(out, "search"),
        resume=resume,
        shard=shared.read_shard(shard),
        recorded=tuple(recorded or ()),
    )

    def describe_row(row: dict[str, Any]) -> str:
        found = f"{len(row['discovered_m'])} found, {row['travel_m']:.2f} m, {row['ended']}"
        return f"{row['simulator']} {row['policy']} seed {row['seed']}: {found}"

    summary = shared.run_in_pool(run_campaign, campaign, executors, describe_row)
    shared.print_summary(summary, campaign.out, print_search, json_)
