"""`glotouch bench faults`: fault injection campaigns."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def faults(
    mission: Annotated[
        str | None,
        typer.Option(
            help="mission with the parameters target and expected_objects (default: retrieve); "
            "with --exhaustive any mission (default: calibrate)"
        ),
    ] = None,
    set_: shared.MissionSettings = None,
    fault: Annotated[list[str] | None, typer.Option(help="only these faults (default: all of the campaign)")] = None,
    skill: Annotated[list[str] | None, typer.Option(help="only in these skills (default: eight)")] = None,
    trials: shared.Trials = 3,
    seed: shared.FirstSeed = 0,
    conditions: shared.Conditions = "nominal",
    objects: shared.Objects = None,
    few: shared.FewObjects = 2,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    workers: shared.Workers = 2,
    cluster: shared.Cluster = None,
    shard: shared.ShardName = None,
    trial_limit: shared.TrialLimit = shared.TRIAL_LIMIT_S,
    out: shared.BenchFolder = None,
    resume: shared.KeepTrials = False,
    keep: Annotated[bool, typer.Option("--keep", help="also keep the records of trials that ended well")] = False,
    exhaustive: Annotated[
        bool, typer.Option("--exhaustive", help="instead fail the n-th call of the robot, n = 0, 1, ... (see --stride)")
    ] = False,
    stride: Annotated[int, typer.Option(min=1, help="with --exhaustive: fail only every N-th call")] = 1,
    json_: shared.SummaryJson = False,
) -> None:
    """Fault injection: each fault in each skill, compared with the unfaulted run of the same seed."""
    from glotouch_bt.commands.terminal import print_exhaustive, print_faults
    from glotouch_bt.mission import load_mission
    from glotouch_bt.validation.faults import (
        Exhaustive,
        FaultCampaign,
        chosen_cases,
        chosen_skills,
        run_campaign,
        run_exhaustive,
    )

    settings = shared.read_settings(set_)
    mission = mission or ("calibrate" if exhaustive else "retrieve")
    shared.check_names(conditions, backend)
    cases = chosen_cases(fault or ())
    skills = chosen_skills(skill or (), cases)
    if exhaustive:
        load_mission(mission, settings, objects=objects)
        study = Exhaustive(mission, settings, backend, seed, stride, shared.bench_folder(out, "faults-exhaustive"))
        found = run_exhaustive(study, lambda n, name: print(f"{name}: call {n}", file=sys.stderr))
        return shared.print_summary(found, study.out, print_exhaustive, json_)
    folder = shared.bench_folder(out, "faults")
    box, settings = shared.put_few_in_box(mission, settings, objects, few, folder / "objects")
    campaign = FaultCampaign(
        mission=mission,
        settings=settings,
        cases=cases,
        skills=skills,
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=box,
        backend=backend,
        out=folder,
        resume=resume,
        shard=shared.read_shard(shard),
        keep=keep,
    )

    def describe_row(row: dict[str, Any]) -> str:
        what = f"{row['class']} in {row['skill']}" if row["skill"] else "unfaulted"
        ending = f"{row['verdict']} {row.get('cause') or ''}" if row["effective"] else "altered nothing"
        return f"seed {row['seed']} {what}: {ending} ({row['wall_s']:.0f} s)"

    summary = shared.run_in_pool(run_campaign, campaign, shared.Executors(workers, cluster, trial_limit), describe_row)
    shared.print_summary(summary, campaign.out, print_faults, json_)
