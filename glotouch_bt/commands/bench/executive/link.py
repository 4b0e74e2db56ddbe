"""`glotouch bench link`: the duration of one control cycle."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from glotouch_bt.commands import shared


@shared.guarded
def link(
    backend: shared.Backend = "flexiv_xense",
    duration: Annotated[float, typer.Option(min=0.1, help="seconds of robot time")] = 60.0,
    set_: shared.BackendSettings = None,
    out: shared.BenchFolder = None,
    json_: shared.SummaryJson = False,
) -> None:
    """Duration of one control cycle, from the setpoint sent to the state received: p50, p99, p99.9."""
    from glotouch_bt.commissioning import LinkStudy, run_study

    summary = run_study(LinkStudy(backend, shared.bench_folder(out, "link"), shared.read_settings(set_), duration))
    if json_:
        shared.print_json(summary)
        return
    for name in ("cycle_ms", "latency_ms"):
        if summary[name] is not None:
            row = "  ".join(f"{k} {v:.3f}" for k, v in summary[name].items())
            sys.stdout.write(f"{name:12s} {row}\n")
    sys.stdout.write(f"{summary['cycles']} cycles, {summary['late_periods']} periods whose command came late\n")
