"""`glotouch bench speed`: wall time of a mission."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Annotated, Any

import typer

from glotouch_bt.commands.bench.shared import print_summary
from glotouch_bt.commands.shared import (
    Backend,
    BenchFolder,
    Conditions,
    FirstSeed,
    MissionSettings,
    Objects,
    SummaryJson,
    Trials,
    bench_folder,
    guarded,
    read_settings,
)


@guarded
def speed(
    mission: Annotated[str, typer.Option(help="the mission to time")] = "retrieve",
    set_: MissionSettings = None,
    trials: Trials = 10,
    seed: FirstSeed = 0,
    conditions: Conditions = "nominal",
    objects: Objects = None,
    backend: Backend = "mujoco",
    out: BenchFolder = None,
    json_: SummaryJson = False,
) -> None:
    """Speed: wall time of a mission against simulated time, and against the bare solver steps."""
    from glotouch_bt.bench import SpeedStudy, run_study
    from glotouch_bt.commands.terminal import print_speed

    study = SpeedStudy(
        mission=mission,
        settings=read_settings(set_),
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=bench_folder(out, "speed"),
    )

    def show(row: Mapping[str, Any], done: int, total: int) -> None:
        sys.stderr.write(
            f"[{done}/{total}] seed {row['seed']}: {row['status']}, {row['sim_s']:.0f} s in {row['wall_s']:.1f} s "
            f"({row['realtime_factor']:.1f}x), {row['over_physics']:.2f}x the bare steps\n"
        )

    summary = run_study(study, show)
    print_summary(summary, study.out, print_speed, json_)
