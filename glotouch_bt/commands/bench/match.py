"""`glotouch bench match`: recognition of touched objects."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.bench.shared import print_summary, worker_pool
from glotouch_bt.commands.shared import (
    Backend,
    BenchFolder,
    Conditions,
    FirstSeed,
    Objects,
    SummaryJson,
    Workers,
    bench_folder,
    check_names,
    guarded,
)


@guarded
def match(
    phases: Annotated[int, typer.Option(min=1, help="number of layouts; each gives one decision per object")] = 24,
    seed: FirstSeed = 400,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    strangers: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="folder of STL files of objects that are not in the box, as targets"),
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="recorded TouchSets to use instead of new ones (with their own conditions)"),
    ] = None,
    method: Annotated[list[str] | None, typer.Option(help="only these matchers (default: all)")] = None,
    backend: Backend = "mujoco",
    workers: Workers = 2,
    out: BenchFolder = None,
    json_: SummaryJson = False,
) -> None:
    """Recognition: which touched object is the target, by matcher and ablation of the paper."""
    from glotouch_bt.bench.match import MatchCampaign, chosen, run_campaign
    from glotouch_bt.commands.terminal import print_match

    check_names(conditions, backend)
    campaign = MatchCampaign(
        seeds=tuple(range(seed, seed + phases)),
        conditions=conditions,
        objects=objects,
        strangers=strangers,
        dataset=dataset,
        methods=chosen(method or ()),
        backend=backend,
        out=bench_folder(out, "match"),
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        right = ", ".join(f"{name} {n}" for name, n in row["right"].items())
        sys.stderr.write(
            f"[{done}/{total}] seed {row['seed']}: {row['ended']}, {row['touched']} of {row['objects']} touched; "
            f"right: {right or 'none'}\n"
        )

    with worker_pool(workers) as pool:
        summary = run_campaign(campaign, pool, show)
    print_summary(summary, campaign.out, print_match, json_)
