"""`glotouch bench retrieve`: the whole mission, for every object and seed."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from glotouch_bt.commands.bench.shared import print_summary, worker_pool
from glotouch_bt.commands.shared import (
    Backend,
    BenchFolder,
    Conditions,
    FirstSeed,
    KeepTrials,
    Objects,
    Settings,
    SummaryJson,
    Trials,
    Workers,
    bench_folder,
    check_parameters,
    guarded,
    read_settings,
)


@guarded
def retrieve(
    mission: Annotated[str, typer.Option(help="mission with the parameter target")] = "retrieve",
    target: Annotated[list[str] | None, typer.Option(help="only these targets (default: every object)")] = None,
    trials: Trials = 10,
    seed: FirstSeed = 0,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    backend: Backend = "mujoco",
    set_: Settings = None,
    resume: KeepTrials = False,
    workers: Workers = 2,
    out: BenchFolder = None,
    json_: SummaryJson = False,
) -> None:
    """Retrieval: the whole mission for every target and seed."""
    from glotouch_bt.bench import RetrieveCampaign, run_campaign, targets_of
    from glotouch_bt.commands.terminal import print_retrieve
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput

    names = tuple(target) if target else targets_of(objects) if objects else ()
    settings = read_settings(set_)
    if "target" in settings:
        raise BadInput("--set target: use --target to choose the targets of a campaign")
    # The default target may be missing from other objects: load the mission with a target that exists.
    loaded = load_mission(mission, settings | ({"target": names[0]} if names else {}), objects=objects)
    check_parameters(loaded, ("target",))
    campaign = RetrieveCampaign(
        mission=mission,
        targets=names or targets_of(loaded.world.objects.folder),
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=bench_folder(out, "retrieve"),
        settings=settings,
        resume=resume,
    )

    def show(row: dict[str, Any], done: int, total: int) -> None:
        verdict = row["cause"] or "retrieved"
        sys.stderr.write(f"[{done}/{total}] {row['target']} seed {row['seed']}: {verdict}\n")

    with worker_pool(workers) as pool:
        summary = run_campaign(campaign, pool, show)
    print_summary(summary, campaign.out, print_retrieve, json_)
