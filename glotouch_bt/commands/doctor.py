"""`glotouch bench link`, and `glotouch doctor`: looking at a robot before it is trusted with a mission."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.options import bench_folder, read_settings
from glotouch_bt.commands.terminal import guarded

Backend = Annotated[str, typer.Option(help="a registered backend (see: glotouch backends)")]
Sets = Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a backend option")]
Json = Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")]


@guarded
def link(
    backend: Backend = "flexiv_xense",
    duration: Annotated[float, typer.Option(min=0.1, help="seconds on the robot's clock")] = 60.0,
    set_: Sets = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="where summary.json goes")] = None,
    json_: Json = False,
) -> None:
    """How long one cycle takes, setpoint out to state in: p50, p99, p99.9."""
    from glotouch_bt.commissioning import LinkStudy, run_study

    summary = run_study(LinkStudy(backend, bench_folder(out, "link"), read_settings(set_), duration))
    if json_:
        sys.stdout.write(json.dumps(summary, indent=2) + "\n")
        return
    for name in ("cycle_ms", "latency_ms"):
        if summary[name] is not None:
            row = "  ".join(f"{k} {v:.3f}" for k, v in summary[name].items())
            sys.stdout.write(f"{name:12s} {row}\n")
    sys.stdout.write(f"{summary['cycles']} cycles, {summary['late_periods']} periods without a command in time\n")


@guarded
def doctor(
    backend: Backend = "flexiv_xense",
    set_: Sets = None,
    mission: Annotated[str, typer.Option(help="the mission whose container is registered")] = "retrieve",
    conditions: Annotated[str, typer.Option(help="disturbances, for simulated robots")] = "nominal",
    yes: Annotated[bool, typer.Option("--yes", help="agree to every step (simulated robots only)")] = False,
    json_: Json = False,
) -> int:
    """Look at a robot before it is trusted: versions, rates, noise, jaws, pads, walls; asks before it moves."""
    from glotouch_bt.commissioning import Finding, nearly_empty, visit
    from glotouch_bt.mission import load_mission
    from glotouch_bt.mission.read import load_conditions
    from glotouch_bt.robot import BadInput, load_backend

    options = read_settings(set_)
    chosen = load_backend(backend)
    real = getattr(chosen, "is_real", lambda _: False)(options)
    if yes and real:
        raise BadInput("--yes is for simulated robots; a real one is looked at step by step")
    if not yes and not sys.stdin.isatty():
        raise BadInput("nobody can be asked here (no terminal); --yes agrees to everything on simulated robots")
    world, findings = load_mission(mission, {}).world, list[Finding]()
    if not real:
        world = nearly_empty(world)

    def ask(question: str) -> bool:
        return yes or typer.confirm(question, err=True)

    def tell(finding: Finding) -> None:
        mark = {True: "ok", False: "LOOK", None: "--"}[finding.good]
        sys.stdout.write(f"{mark:4s} {finding.step:6s} {finding.what:12s} {finding.text}\n")
        sys.stdout.flush()

    for finding in visit(chosen, world, load_conditions(conditions), options, ask, sure=not yes):
        findings.append(finding)
        if not json_:
            tell(finding)
    if json_:
        sys.stdout.write(json.dumps([f.as_dict() for f in findings], indent=2) + "\n")
    return 0 if all(f.good is not False for f in findings) else 1
