"""`glotouch bench contact`: accuracy of the traced calibration square."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def contact(
    trials: shared.Trials = 20,
    seed: shared.FirstSeed = 100,
    conditions: shared.Conditions = "nominal",
    set_: shared.MissionSettings = None,
    per_side: Annotated[int, typer.Option(min=1, max=15, help="contacts per side")] = 4,
    resume: shared.KeepTrials = False,
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Contact: errors of a calibration square traced by probe and by bare gripper, fixed and free.

    `--set` gives parameters of the mission `contact_probe`.
    """
    from glotouch_bt.bench.contact import ContactCampaign, run_campaign
    from glotouch_bt.commands.terminal import print_contact
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput

    shared.check_names(conditions, "mujoco")
    settings = shared.read_settings(set_)
    for name, instead in (("contacts", "use --per-side"), ("fixed", "every seed has a bolted and a free square")):
        if name in settings:
            raise BadInput(f"--set {name}: {instead}")
    load_mission("contact_probe", settings)  # refuses what is no parameter of it
    campaign = ContactCampaign(
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        settings=settings,
        per_side=per_side,
        out=shared.bench_folder(out, "contact"),
        resume=resume,
        shard=shared.read_shard(shard),
    )

    def describe_row(row: dict[str, Any]) -> str:
        ending = row["cause"] or f"centre {row['centre_error_mm']:.2f} mm"
        return f"{row['tool']} {row['square']} seed {row['seed']}: {ending}"

    summary = shared.run_in_pool(
        run_campaign,
        campaign,
        shared.Executors(workers, cluster, trial_limit),
        describe_row,
        lambda row: not row["cause"],
    )
    shared.print_summary(summary, campaign.out, print_contact, json_)
