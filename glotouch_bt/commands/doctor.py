"""`glotouch doctor`: the tests of a robot before its first mission."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import Annotated

import typer

from glotouch_bt.commands.shared import Backend, BackendSettings, Conditions, Json, guarded, print_json, read_settings


@guarded
def doctor(
    backend: Backend = "flexiv_xense",
    set_: BackendSettings = None,
    mission: Annotated[str, typer.Option(help="mission whose container is registered")] = "retrieve",
    conditions: Conditions = "nominal",
    yes: Annotated[bool, typer.Option("--yes", help="agree to every step (simulated robots only)")] = False,
    json_: Json = False,
) -> int:
    """Test a robot before its first mission.

    Reports versions, rates, noise, jaws, gel pads and the container's walls. Asks before it moves the robot.
    """
    from glotouch_bt.commissioning import DoctorFinding, nearly_empty, run_doctor
    from glotouch_bt.mission import load_mission
    from glotouch_bt.mission.read import load_conditions
    from glotouch_bt.robot import BadInput, load_backend

    options = read_settings(set_)
    chosen = load_backend(backend)
    real = getattr(chosen, "is_real", lambda _: False)(options)
    if yes and real:
        raise BadInput("--yes is for simulated robots only; on a real robot each step needs an answer")
    if not yes and not sys.stdin.isatty():
        raise BadInput("doctor asks before it moves, and there is no terminal here; on a simulated robot use --yes")
    world, findings = load_mission(mission, {}).world, list[DoctorFinding]()
    if not real:
        world = nearly_empty(world)

    def ask(question: str) -> bool:
        return yes or typer.confirm(question, err=True)

    def show(finding: DoctorFinding) -> None:
        mark = {True: "ok", False: "LOOK", None: "--"}[finding.good]
        sys.stdout.write(f"{mark:4s} {finding.step:6s} {finding.what:12s} {finding.text}\n")
        sys.stdout.flush()

    for finding in run_doctor(chosen, world, load_conditions(conditions), options, ask, sure=not yes):
        findings.append(finding)
        if not json_:
            show(finding)
    if json_:
        print_json([asdict(f) for f in findings])
    return 0 if all(f.good is not False for f in findings) else 1
