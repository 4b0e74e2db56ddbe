"""`glotouch bench link`, and `glotouch doctor`: looking at a robot before it is trusted with a mission."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.guarded import guarded

Backend = Annotated[str, typer.Option(help="a registered backend (see: glotouch backends)")]
Sets = Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a backend option")]
Json = Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")]


def read_settings(given: list[str] | None) -> dict[str, str]:
    """NAME=VALUE words as a mapping.

    Raises:
        BadInput: A word without "=", or a name given twice.
    """
    from glotouch_bt.robot import BadInput

    settings: dict[str, str] = {}
    for item in given or []:
        name, equals, value = item.partition("=")
        if not equals or not name.strip():
            raise BadInput(f"--set {item}: must be NAME=VALUE")
        if name.strip() in settings:
            raise BadInput(f"--set {name.strip()}: given twice")
        settings[name.strip()] = value
    return settings


@guarded
def link(
    backend: Backend = "flexiv_xense",
    duration: Annotated[float, typer.Option(min=0.1, help="seconds on the robot's clock")] = 60.0,
    set_: Sets = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="where summary.json goes")] = None,
    json_: Json = False,
) -> None:
    """How long one cycle takes, setpoint out to state in: p50, p99, p99.9."""
    from glotouch_bt.cli_bench import _folder
    from glotouch_bt.study.link import LinkStudy, run_study

    summary = run_study(LinkStudy(backend, _folder(out, "link"), read_settings(set_), duration))
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
        return
    for name in ("cycle_ms", "latency_ms"):
        if summary[name] is not None:
            row = "  ".join(f"{k} {v:.3f}" for k, v in summary[name].items())
            sys.stdout.write(f"{name:12s} {row}\n")
    sys.stdout.write(f"{summary['cycles']} cycles, {summary['late_periods']} periods without a command in time\n")
