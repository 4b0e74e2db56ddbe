"""`glotouch bench speed`: wall time of a mission."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def speed(
    mission: Annotated[str, typer.Option(help="the mission to time")] = "retrieve",
    set_: shared.MissionSettings = None,
    trials: shared.Trials = 10,
    seed: shared.FirstSeed = 0,
    conditions: shared.Conditions = "nominal",
    objects: shared.Objects = None,
    backend: shared.Backend = "mujoco",
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Speed: wall time of a mission against simulated time, and against the bare solver steps."""
    from glotouch_bt.bench import run_study
    from glotouch_bt.campaign import Campaign
    from glotouch_bt.commands.terminal import print_speed

    study = Campaign(
        mission=mission,
        settings=shared.read_settings(set_),
        seeds=tuple(range(seed, seed + trials)),
        conditions=conditions,
        objects=objects,
        backend=backend,
        out=shared.bench_folder(out, "speed"),
    )

    def describe_row(row: dict[str, Any]) -> str:
        speed = f"{row['sim_s']:.0f} s in {row['wall_s']:.1f} s ({row['realtime_factor']:.1f}x)"
        return f"seed {row['seed']}: {row['status']}, {speed}, {row['over_physics']:.2f}x the bare steps"

    summary = run_study(study, shared.progress(describe_row))
    shared.print_summary(summary, study.out, print_speed, json_)
