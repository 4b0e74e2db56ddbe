"""`glotouch bench match`: recognition of touched objects."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def match(
    phases: Annotated[int, typer.Option(min=1, help="number of layouts; each gives one decision per object")] = 24,
    seed: shared.FirstSeed = 400,
    conditions: shared.Conditions = "nominal",
    objects: shared.Objects = None,
    strangers: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="folder of STL files of objects that are not in the box, as targets"),
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="recorded TouchSets to use instead of new ones (with their own conditions)"),
    ] = None,
    sampled: Annotated[
        bool, typer.Option("--sampled", help="touch the objects without a robot, in about a second a layout")
    ] = False,
    gel_images: Annotated[
        bool, typer.Option("--gel-images", help="with --sampled: take images of the gels, too, which show fine relief")
    ] = False,
    touched: Annotated[
        bool,
        typer.Option(
            "--touched", help="with --sampled: compare targets known only by touch, each handled once with 20 closures"
        ),
    ] = False,
    in_box: Annotated[int, typer.Option(min=1, help="objects drawn for a layout; above 5 only with --sampled")] = 5,
    method: Annotated[list[str] | None, typer.Option(help="only these matchers (default: all)")] = None,
    backend: shared.Backend = "mujoco",
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Recognition: which touched object is the target, by matcher and ablation of the paper."""
    from glotouch_bt.bench.match import MatchCampaign, chosen, run_campaign
    from glotouch_bt.commands.terminal import print_match

    shared.check_names(conditions, backend)
    campaign = MatchCampaign(
        seeds=tuple(range(seed, seed + phases)),
        conditions=conditions,
        objects=objects,
        strangers=strangers,
        dataset=dataset,
        sampled=sampled,
        gel_images=gel_images,
        touched=touched,
        in_the_box=in_box,
        methods=chosen(method or ()),
        backend=backend,
        out=shared.bench_folder(out, "match"),
        resume=resume,
        shard=shared.read_shard(shard),
    )

    def describe_row(row: dict[str, Any]) -> str:
        right = ", ".join(f"{name} {n}" for name, n in row["right"].items()) or "none"
        touched = f"{row['touched']} of {row['objects']} touched"
        return f"seed {row['seed']}: {row['ended']}, {touched}; right: {right}"

    summary = shared.run_in_pool(run_campaign, campaign, shared.Executors(workers, cluster, trial_limit), describe_row)
    shared.print_summary(summary, campaign.out, print_match, json_)
