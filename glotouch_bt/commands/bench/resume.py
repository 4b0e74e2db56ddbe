"""`glotouch bench resume`: missions killed and resumed."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

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
    bench_folder,
    check_names,
    check_parameters,
    guarded,
    print_json,
    read_settings,
)


@guarded
def resume(
    mission: Annotated[str, typer.Option(help="mission with the parameters target and expected_objects")] = "retrieve",
    set_: MissionSettings = None,
    trials: Trials = 20,
    seed: FirstSeed = 0,
    kills: Annotated[int, typer.Option(min=1, help="kills per seed, each in a run of its own")] = 3,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    few: FewObjects = 2,
    out: BenchFolder = None,
    resume: KeepTrials = False,
    json_: SummaryJson = False,
) -> None:
    """Kill and resume: missions killed (SIGKILL) at random moments, compared with uninterrupted runs."""
    from glotouch_bt.mission import load_mission
    from glotouch_bt.validation import KillStudy, run_study
    from glotouch_bt.validation.faults import few_objects

    settings = read_settings(set_)
    check_names(conditions, "mujoco")
    loaded = load_mission(mission, settings, objects=objects)
    check_parameters(loaded, ("target", "expected_objects"))
    folder = bench_folder(out, "resume")
    box, names = few_objects(loaded.world.objects, few, folder / "objects")
    settings = {"target": names[0], "expected_objects": str(len(names))} | settings
    load_mission(mission, settings, objects=box)
    study = KillStudy(mission, range(seed, seed + trials), kills, folder, settings, conditions, box, resume)

    def show(row: dict[str, Any], done: int, total: int) -> None:
        at = f"[{done}/{total}] seed {row['seed']}: {row['outcome']} at {row['moment']:.0%} of the mission"
        if row["outcome"] == "killed":
            end = "same end" if row["same_end"] else f"DIFFERENT end: {row.get('status')} {row['message']}"
            exact = ", to the bit" if row["same_result"] and row["same_record"] else ""
            at += f", checkpoint {row.get('checkpoint')} of {row.get('checkpoints')}: {end}{exact}"
        sys.stderr.write(f"{at}\n")

    summary = run_study(study, show)
    if json_:
        print_json(summary)
        return
    for name in ("same_end", "same_result", "same_record", "readable", "at_most_the_running_skill_lost"):
        r = summary[name]
        words = name.replace("_", " ")
        sys.stdout.write(f"{words:32s} {r['rate'] * r['n']:.0f} of {r['n']}  ({r['lo']:.3f} .. {r['hi']:.3f})\n")
    if summary["outside"]:
        sys.stdout.write(
            f"{summary['outside']} kills came before the first or after the last skill and are not counted\n"
        )
    if summary["lost_s"]["n"]:
        sys.stdout.write(f"robot time lost: {summary['lost_s']['mean']:.1f} s on average\n")
    sys.stdout.write(f"{folder}\n")
