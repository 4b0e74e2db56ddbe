"""`glotouch bench faults`: fault injection campaigns."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from concurrent.futures import BrokenExecutor
from typing import Annotated, Any

import typer

from glotouch_bt.commands.bench.shared import print_summary, worker_pool
from glotouch_bt.commands.shared import (
    BenchFolder,
    Conditions,
    FewObjects,
    FirstSeed,
    KeepTrials,
    MissionSettings,
    Objects,
    SummaryJson,
    Trials,
    Workers,
    bench_folder,
    check_names,
    check_parameters,
    guarded,
    print_json,
    read_settings,
)


@guarded
def faults(
    mission: Annotated[
        str | None,
        typer.Option(
            help="mission with the parameters target and expected_objects (default: retrieve); "
            "with --exhaustive any mission (default: calibrate)"
        ),
    ] = None,
    set_: MissionSettings = None,
    fault: Annotated[list[str] | None, typer.Option(help="only these faults (default: all of the campaign)")] = None,
    skill: Annotated[list[str] | None, typer.Option(help="only in these skills (default: eight)")] = None,
    trials: Trials = 3,
    seed: FirstSeed = 0,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    few: FewObjects = 2,
    backend: Annotated[str, typer.Option(help="a registered simulation backend")] = "mujoco",
    workers: Workers = 2,
    out: BenchFolder = None,
    resume: KeepTrials = False,
    keep: Annotated[bool, typer.Option("--keep", help="also keep the records of trials that ended well")] = False,
    exhaustive: Annotated[
        bool, typer.Option("--exhaustive", help="instead fail the n-th call of the robot, n = 0, 1, ... (see --stride)")
    ] = False,
    stride: Annotated[int, typer.Option(min=1, help="with --exhaustive: fail only every N-th call")] = 1,
    json_: SummaryJson = False,
) -> None:
    """Fault injection: each fault in each skill, compared with the unfaulted run of the same seed."""
    from glotouch_bt.commands.terminal import print_exhaustive, print_faults
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import GlotouchError
    from glotouch_bt.validation.faults import (
        Exhaustive,
        FaultCampaign,
        chosen_cases,
        chosen_skills,
        few_objects,
        run_campaign,
        run_exhaustive,
    )

    settings = read_settings(set_)
    mission = mission or ("calibrate" if exhaustive else "retrieve")
    check_names(conditions, backend)
    cases = chosen_cases(fault or ())
    skills = chosen_skills(skill or (), cases)
    loaded = load_mission(mission, settings, objects=objects)
    if exhaustive:
        study = Exhaustive(mission, settings, backend, seed, stride, bench_folder(out, "faults-exhaustive"))
        found = run_exhaustive(study, lambda n, name: print(f"{name}: call {n}", file=sys.stderr))
        if json_:
            print_json(found)
        else:
            print_exhaustive(found, study.out)
        return
    check_parameters(loaded, ("target", "expected_objects"))
    folder = bench_folder(out, "faults")
    box, names = few_objects(loaded.world.objects, few, folder / "objects")
    settings = {"target": names[0], "expected_objects": str(len(names))} | settings
    load_mission(mission, settings, objects=box)
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
        keep=keep,
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        what = f"{row['class']} in {row['skill']}" if row["skill"] else "unfaulted"
        ending = f"{row['verdict']} {row.get('cause') or ''}" if row["effective"] else "altered nothing"
        sys.stderr.write(f"[{done}/{total}] seed {row['seed']} {what}: {ending} ({row['wall_s']:.0f} s)\n")

    try:
        with worker_pool(workers) as pool:
            summary = run_campaign(campaign, pool, show)
    except BrokenExecutor as e:
        raise GlotouchError(f"a trial ended its worker process; continue with --resume --out {folder}") from e
    print_summary(summary, campaign.out, print_faults, json_)
