"""`glotouch bench space`: objects that are pushed, or lifted out and set down elsewhere."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def space(
    act: Annotated[list[str] | None, typer.Option(help="nudge or clear (default: both)")] = None,
    trials: shared.Trials = 40,
    seed: shared.FirstSeed = 0,
    conditions: shared.Conditions = "nominal",
    set_condition: shared.SetConditions = None,
    world: shared.WorldName = None,
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Space: push each object of a layout once, lift each one out; is it where the map says, and does it stand?

    Each trial is a layout of five objects, so 40 trials ask for 200 pushes.
    """
    from glotouch_bt.bench.space import ACTS, SpaceCampaign, run_campaign
    from glotouch_bt.commands.terminal import print_space
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput

    acts = tuple(dict.fromkeys(act)) if act else ACTS
    for name in acts:
        if name not in ACTS:
            raise BadInput(f"--act {name}: choose from {', '.join(ACTS)}")
        load_mission(f"{name}_each", {}, world=world)
    campaign = SpaceCampaign(
        acts=acts,
        seeds=tuple(range(seed, seed + trials)),
        conditions=shared.changed_conditions(conditions, set_condition),
        world=world,
        out=shared.bench_folder(out, "space"),
        resume=resume,
        shard=shared.read_shard(shard),
    )

    def describe_row(row: dict[str, Any]) -> str:
        moved = [t for t in row["objects"] if t["done"]]
        errors = ", ".join(f"{t['position_error_mm']:.1f}" for t in moved if t.get("position_error_mm") is not None)
        ending = row["cause"] or f"{len(moved)} of {len(row['objects'])} moved, {errors or '-'} mm off"
        return f"{row['act']} seed {row['seed']}: {ending}"

    summary = shared.run_in_pool(
        run_campaign,
        campaign,
        shared.Executors(workers, cluster, trial_limit),
        describe_row,
        lambda row: not row["cause"],
    )
    shared.print_summary(summary, campaign.out, print_space, json_)
