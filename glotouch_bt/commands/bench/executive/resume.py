"""`glotouch bench resume`: missions killed and resumed."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def resume(
    mission: Annotated[str, typer.Option(help="mission with the parameters target and expected_objects")] = "retrieve",
    set_: shared.MissionSettings = None,
    trials: shared.Trials = 20,
    seed: shared.FirstSeed = 0,
    kills: Annotated[int, typer.Option(min=1, help="kills per seed, each in a run of its own")] = 3,
    conditions: shared.Conditions = "nominal",
    objects: shared.Objects = None,
    few: shared.FewObjects = 2,
    out: shared.BenchFolder = None,
    resume: shared.KeepTrials = False,
    json_: shared.SummaryJson = False,
) -> None:
    """Kill and resume: missions killed (SIGKILL) at random moments, compared with uninterrupted runs."""
    from glotouch_bt.validation import KillStudy, run_study

    settings = shared.read_settings(set_)
    shared.check_names(conditions, "mujoco")
    folder = shared.bench_folder(out, "resume")
    box, settings = shared.put_few_in_box(mission, settings, objects, few, folder / "objects")
    study = KillStudy(
        mission=mission,
        settings=settings,
        seeds=tuple(range(seed, seed + trials)),
        kills=kills,
        conditions=conditions,
        objects=box,
        out=folder,
        resume=resume,
    )

    def describe_row(row: dict[str, Any]) -> str:
        at = f"seed {row['seed']}: {row['outcome']} at {row['moment']:.0%} of the mission"
        if row["outcome"] == "killed":
            end = "same end" if row["same_end"] else f"DIFFERENT end: {row.get('status')} {row['message']}"
            exact = ", to the bit" if row["same_result"] and row["same_record"] else ""
            at += f", checkpoint {row.get('checkpoint')} of {row.get('checkpoints')}: {end}{exact}"
        return at

    summary = run_study(study, shared.progress(describe_row))
    if json_:
        shared.print_json(summary)
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
