"""`glotouch bench pause`: missions that are paused again and again beside their undisturbed twins."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.terminal import guarded


@guarded
def bench_pause(
    mission: Annotated[str, typer.Option(help="path of a mission, or the name of a shipped one")] = "retrieve",
    set_: Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter")] = None,
    trials: Annotated[int, typer.Option(min=1, help="seeds, a paused run and its twin each")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="first seed")] = 0,
    every: Annotated[int, typer.Option(min=1, help="ticks of the tree from one pause to the next")] = 50,
    pause: Annotated[float, typer.Option(min=0.01, help="robot time each pause is asked for, s")] = 1.0,
    conditions: Annotated[str, typer.Option(help="disturbances: ideal, nominal, harsh, or a file")] = "nominal",
    backend: Annotated[str, typer.Option(help="a registered backend")] = "mujoco",
    objects: Annotated[
        Path | None, typer.Option("--objects", metavar="DIR", help="folder of watertight STL files in metres")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="the study's folder (default: runs/bench-...)")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="print summary.json on stdout, nothing else")] = False,
) -> None:
    """Pause a mission at every n-th tick: does it end as its twin does, and keep the hard limit?"""
    from glotouch_bt.commands.options import bench_folder, check_names, read_settings
    from glotouch_bt.commands.terminal import console
    from glotouch_bt.mission import load_mission
    from glotouch_bt.validation import PauseStudy, run_pauses

    check_names(conditions, backend)
    settings = read_settings(set_)
    load_mission(mission, settings, objects=objects)
    seeds = tuple(range(seed, seed + trials))
    study = PauseStudy(mission, settings, seeds, every, pause, conditions, backend, objects, bench_folder(out, "pause"))

    def told(row: dict[str, Any], done: int, total: int) -> None:
        same = "as its twin" if row["same"] else f"NOT as its twin ({row['cause'] or row['retrieved']})"
        sys.stderr.write(
            f"{done}/{total} seed {row['seed']}: {row['status']}, "
            f"{row['retrieved'] or 'nothing'} in the gripper, {same}; "
            f"{row['pauses']} pauses, peak {row['peak_force_N']:.1f} N, {row['wall_s']:.0f} s\n"
        )

    summary = run_pauses(study, told)
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
        return
    rows = [
        (
            str(r["seed"]),
            str(r["retrieved"] or "-"),
            str(r["twin_retrieved"] or "-"),
            "yes" if r["same"] else "no",
            f"{r['pauses']} ({r['on_the_way']} on the way, {r['backed_off']} backed off)",
            f"{r['longest_to_rest_s']:.2f}",
            f"{r['peak_force_N']:.1f} ({r['twin_peak_force_N']:.1f})",
        )
        for r in summary["trials"]
    ]
    head = ("seed", "in the gripper", "its twin's", "same", "pauses", "longest to rest, s", "peak (twin's), N")
    console.print_table(f"{mission}, a pause of {pause:g} s at every {every}th tick, {conditions}", head, rows)
    same = summary["same"]
    sys.stdout.write(f"as the twin: {round(same['rate'] * same['n'])} of {same['n']}; ")
    broken = summary["hard_limit_broken"]
    sys.stdout.write(f"hard limit broken: {broken} time{'' if broken == 1 else 's'}; summary: {study.out}\n")
