"""`glotouch bench retrieve`: the whole mission, for every object and seed."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def retrieve(
    mission: Annotated[str, typer.Option(help="mission with the parameter target")] = "retrieve",
    target: Annotated[list[str] | None, typer.Option(help="only these targets (default: every object)")] = None,
    per_seed: Annotated[int | None, typer.Option(help="targets for each seed, in turn (default: all)", min=1)] = None,
    trials: shared.Trials = 10,
    seed: shared.FirstSeed = 0,
    conditions: shared.Conditions = "nominal",
    set_condition: shared.SetConditions = None,
    objects: shared.Objects = None,
    world: shared.WorldName = None,
    backend: shared.Backend = "mujoco",
    set_: shared.Settings = None,
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Retrieval: the whole mission for every target and seed."""
    from glotouch_bt.bench import RetrieveCampaign, run_campaign, succeeded, targets_of
    from glotouch_bt.commands.terminal import print_retrieve
    from glotouch_bt.mission import load_mission
    from glotouch_bt.mission.read import load_world
    from glotouch_bt.robot import BadInput

    folder = objects or (load_world(world).objects.folder if world else None)
    names = tuple(target) if target else targets_of(folder) if folder else ()
    settings = shared.read_settings(set_)
    if "target" in settings:
        raise BadInput("--set target: use --target to choose the targets of a campaign")
    # The default target may be missing from other objects: load the mission with a target that exists.
    loaded = load_mission(mission, settings | ({"target": names[0]} if names else {}), objects=objects, world=world)
    shared.check_parameters(loaded, ("target",))
    campaign = RetrieveCampaign(
        mission=mission,
        targets=names or targets_of(loaded.world.objects.folder),
        per_seed=per_seed,
        seeds=tuple(range(seed, seed + trials)),
        conditions=shared.changed_conditions(conditions, set_condition),
        objects=objects,
        world=world,
        backend=backend,
        out=shared.bench_folder(out, "retrieve"),
        settings=settings,
        resume=resume,
        shard=shared.read_shard(shard),
    )

    def describe_row(row: dict[str, Any]) -> str:
        return f"{row['target']} seed {row['seed']}: {row['cause'] or 'retrieved'}"

    summary = shared.run_in_pool(
        run_campaign, campaign, shared.Executors(workers, cluster, trial_limit), describe_row, succeeded
    )
    shared.print_summary(summary, campaign.out, print_retrieve, json_)
