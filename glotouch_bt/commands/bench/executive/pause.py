"""`glotouch bench pause`: missions paused again and again."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def pause(
    mission: Annotated[str, typer.Option(help="path of a mission file, or the name of a shipped mission")] = "retrieve",
    set_: shared.MissionSettings = None,
    trials: shared.Trials = 3,
    seed: shared.FirstSeed = 0,
    every: Annotated[int, typer.Option(min=1, help="ticks of the tree between two pauses")] = 50,
    pause_s: Annotated[
        float, typer.Option("--pause", min=0.01, help="requested duration of each pause, s of robot time")
    ] = 1.0,
    conditions: shared.Conditions = "nominal",
    backend: shared.Backend = "mujoco",
    objects: shared.Objects = None,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Pauses: missions paused at every N-th tick, compared with undisturbed runs of the same seed."""
    from glotouch_bt.commands.terminal import print_table
    from glotouch_bt.mission import load_mission
    from glotouch_bt.validation import PauseStudy, run_pauses

    shared.check_names(conditions, backend)
    settings = shared.read_settings(set_)
    load_mission(mission, settings, objects=objects)
    study = PauseStudy(
        mission=mission,
        settings=settings,
        seeds=tuple(range(seed, seed + trials)),
        every=every,
        pause_s=pause_s,
        conditions=conditions,
        backend=backend,
        objects=objects,
        out=shared.bench_folder(out, "pause"),
    )

    def show(row: dict[str, Any], done: int, total: int) -> None:
        same = "same end" if row["same"] else f"DIFFERENT end ({row['cause'] or row['retrieved']})"
        sys.stderr.write(
            f"{done}/{total} seed {row['seed']}: {row['status']}, "
            f"{row['retrieved'] or 'nothing'} in the gripper, {same}; "
            f"{row['pauses']} pauses, peak {row['peak_force_N']:.1f} N, {row['wall_s']:.0f} s\n"
        )

    summary = run_pauses(study, show)
    if json_:
        shared.print_json(summary)
        return
    rows = [
        (
            str(r["seed"]),
            str(r["retrieved"] or "-"),
            str(r["twin_retrieved"] or "-"),
            "yes" if r["same"] else "no",
            f"{r['pauses']} ({r['on_the_way']} during a motion, {r['backed_off']} backed off)",
            f"{r['longest_to_rest_s']:.2f}",
            f"{r['peak_force_N']:.1f} ({r['twin_peak_force_N']:.1f})",
        )
        for r in summary["trials"]
    ]
    head = ("seed", "in the gripper", "undisturbed", "same", "pauses", "longest to rest, s", "peak (undisturbed), N")
    print_table(f"{mission}, {pause_s:g} s of pause every {every} ticks, {conditions}", head, rows)
    same = summary["same"]
    sys.stdout.write(f"same end: {round(same['rate'] * same['n'])} of {same['n']}; ")
    sys.stdout.write(f"hard limit broken: {summary['hard_limit_broken']}; summary: {study.out}\n")
