"""`glotouch bench detection`: false alarms and sensitivity of contact detection."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands import shared


@shared.guarded
def detection(
    conditions: Annotated[
        list[str] | None, typer.Option(help="disturbances; repeat for more (default: nominal and harsh)")
    ] = None,
    trials: Annotated[int, typer.Option(min=1, help="synthetic pushes of each kind and force")] = 100,
    seed: shared.FirstSeed = 100,
    hours: Annotated[
        float, typer.Option(min=0.001, help="duration of the synthetic signal for each kind of motion, h")
    ] = 2.0,
    minutes: Annotated[float, typer.Option(min=0.1, help="duration of simulated guarded free motion, min")] = 31.0,
    pushes: Annotated[int, typer.Option(min=1, help="number of simulated pushes of 0.6 N")] = 40,
    robots: Annotated[int, typer.Option(min=1, help="number of simulated robots, on the first seeds")] = 1,
    backend: shared.Backend = "mujoco",
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Detection: false alarms of the contact guard in free motion, and the smallest pushes it detects."""
    from glotouch_bt.bench.detection import DetectionStudy, run_study

    profiles = tuple(conditions or ("nominal", "harsh"))
    for profile in profiles:
        shared.check_names(profile, backend)
    seeds = tuple(range(seed, seed + trials))
    study = DetectionStudy(
        profiles, seeds, hours, minutes, pushes, robots, backend, shared.bench_folder(out, "detection")
    )
    summary = run_study(study, lambda line: print(line, file=sys.stderr))
    shared.print_summary(summary, study.out, _print_detection, json_)


def _print_detection(summary: dict[str, Any], folder: Path) -> None:
    from glotouch_bt.bench.detection import table

    sys.stdout.write("\n".join(table(summary)) + f"\n{folder / 'summary.json'}\n")
