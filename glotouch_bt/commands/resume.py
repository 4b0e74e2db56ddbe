"""`glotouch resume`: go on with a run that was broken off."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.terminal import guarded

Json = Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")]


@guarded
def resume(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="folder of a run that was broken off")],
    from_: Annotated[
        str | None, typer.Option("--from", metavar="NODE", help="start at this node (its name or path) instead")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="go on in a copy of the run there")] = None,
    list_: Annotated[bool, typer.Option("--list", help="only show the checkpoints")] = False,
    json_: Json = False,
) -> int:
    """Go on with a run after a crash, a kill, Ctrl-C or a safety stop; finished skills are not done again."""
    from glotouch_bt.commands.terminal import Operator, console, operated, tell_end
    from glotouch_bt.run import ResumableRun
    from glotouch_bt.run import resume as go_on

    if list_:
        _list(folder, json_)
        return 0

    told: list[str] = []

    def tell(found: ResumableRun) -> None:
        told.extend(found.notes)
        if json_:
            return
        row = found.row
        after = f"after {row.node}" if row.node else "before the first skill"
        where = f", starting at {found.start}" if found.start else ""
        sys.stderr.write(f"checkpoint {row.number}, t = {row.stamp_s:.1f} s, {after}{where}\n")
        for note in found.notes:
            sys.stderr.write(f"note: {note}\n")

    with console.RunProgress(quiet=json_) as progress, operated(Operator()) as control:
        done = go_on(
            folder,
            start=from_,
            out=out,
            on_found=tell,
            on_start=progress.start,
            on_progress=progress.update,
            control=control,
        )
    for note in done.result["resumed"][-1]["notes"] if not json_ else ():
        if note not in told:  # it was found out when the record was taken up
            sys.stderr.write(f"note: {note}\n")
    return tell_end(done, json_)


@guarded
def bench_resume(
    mission: Annotated[str, typer.Option(help="a mission with `target` and `expected_objects`")] = "retrieve",
    set_: Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter")] = None,
    trials: Annotated[int, typer.Option(min=1, help="seeds, one unbroken twin each")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="first seed")] = 0,
    kills: Annotated[int, typer.Option(min=1, help="moments a seed")] = 3,
    conditions: Annotated[str, typer.Option(help="disturbances: ideal, nominal, harsh, or a file")] = "nominal",
    objects: Annotated[Path | None, typer.Option(metavar="DIR", help="folder of watertight STL files")] = None,
    few: Annotated[int, typer.Option(min=1, help="only the first so many objects are in the box: it is quicker")] = 2,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="where trials and summary go")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="keep the trials that are in --out already")] = False,
    json_: Json = False,
) -> None:
    """Kill missions (SIGKILL) at random moments, resume them, and compare each with its unbroken twin."""
    from glotouch_bt.commands.options import bench_folder, check_names, read_settings
    from glotouch_bt.mission import load_mission
    from glotouch_bt.validation import KillStudy, run_study
    from glotouch_bt.validation.faults import few_objects

    settings = read_settings(set_)
    check_names(conditions, "mujoco")
    world = load_mission(mission, settings, objects=objects).world
    folder = bench_folder(out, "resume")
    box, names = few_objects(world.objects, few, folder / "objects")
    settings = {"target": names[0], "expected_objects": str(len(names))} | settings
    load_mission(mission, settings, objects=box)
    study = KillStudy(mission, range(seed, seed + trials), kills, folder, settings, conditions, box, resume)

    def show(row: dict[str, Any], done: int, total: int) -> None:
        at = f"[{done}/{total}] seed {row['seed']}: {row['outcome']} at {row['moment']:.0%} of the mission"
        if row["outcome"] == "killed":
            said = "as its twin" if row["same_end"] else f"NOT as its twin: {row.get('status')} {row['message']}"
            exact = ", to the bit" if row["same_result"] and row["same_record"] else ""
            at += f", checkpoint {row.get('checkpoint')} of {row.get('checkpoints')}: {said}{exact}"
        sys.stderr.write(f"{at}\n")

    summary = run_study(study, show)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
        return
    for name in ("same_end", "same_result", "same_record", "readable", "at_most_the_running_skill_lost"):
        r = summary[name]
        words = name.replace("_", " ")
        sys.stdout.write(f"{words:32s} {r['rate'] * r['n']:.0f} of {r['n']}  ({r['lo']:.3f} .. {r['hi']:.3f})\n")
    if summary["outside"]:
        sys.stdout.write(f"{summary['outside']} kills came before the mission or after its last skill; not counted\n")
    if summary["lost_s"]["n"]:
        sys.stdout.write(f"robot time lost {summary['lost_s']['mean']:.1f} s on average\n")
    sys.stdout.write(f"{folder}\n")


def _list(folder: Path, json_: bool) -> None:
    from glotouch_bt.commands.terminal import console
    from glotouch_bt.mission.checkpoint import FILE, CheckpointFile

    file = CheckpointFile(folder / FILE)
    rows, run = file.rows(), file.run
    file.close()
    if json_:
        told = [
            {"number": r.number, "at_s": r.stamp_s, "node": r.node, "status": r.status, "begun": list(r.begun),
             "lacking": dict(r.lacking), "world": r.has_world}
            for r in rows
        ]  # fmt: skip
        sys.stdout.write(json.dumps({"ended": run.get("ended"), "checkpoints": told}, indent=2) + "\n")
        return
    table = [
        (str(r.number), f"{r.stamp_s:.1f}", r.node or "(before the first skill)", r.status, ", ".join(r.lacking))
        for r in rows
    ]
    title = f"checkpoints of {folder} ({run.get('ended') or 'broken off'})"
    console.print_table(title, ("number", "t [s]", "after", "status", "lacks"), table)
