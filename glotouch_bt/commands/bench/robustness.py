"""`glotouch bench robustness`: recognition against each axis of the conditions alone."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def robustness(
    boxes: Annotated[int, typer.Option(min=1, help="boxes a point; every target of a box is one decision")] = 10,
    seed: shared.FirstSeed = 0,
    axis: Annotated[list[str] | None, typer.Option(help="only these axes (default: all)")] = None,
    conditions: shared.Conditions = "nominal",
    missions: Annotated[
        bool, typer.Option("--missions", help="one whole mission a box instead of touches without a robot: hours")
    ] = False,
    objects: shared.Objects = None,
    backend: shared.Backend = "mujoco",
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Robustness: recognition with one property of gel, gripper, arm or objects varied at a time.

    On touches of standing objects, computed without a robot in about a second a box, or by whole missions.
    """
    from glotouch_bt.bench.robustness import AXES, RobustnessCampaign, run_campaign, run_missions
    from glotouch_bt.commands.terminal import print_robustness

    shared.check_names(conditions, backend)
    campaign = RobustnessCampaign(
        seeds=tuple(range(seed, seed + boxes)),
        axes=tuple(axis or AXES),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=shared.bench_folder(out, "robustness"),
        resume=resume,
        shard=shared.read_shard(shard),
    )

    def describe_row(row: dict[str, Any]) -> str:
        where = f"{row['axis']} {row['level']:g}" if row["axis"] else conditions
        if missions:
            return f"{where} seed {row['seed']}: {row['target']} {row['cause'] or 'retrieved'}"
        return f"{where} seed {row['seed']}: {row['accepted']} of {row['decisions']} right and accepted{row['cause']}"

    executors = shared.Executors(workers, cluster, trial_limit)
    summary = shared.run_in_pool(run_missions if missions else run_campaign, campaign, executors, describe_row)
    shared.print_summary(summary, campaign.out, print_robustness, json_)
