"""`glotouch check`: find the mistakes of missions before anything moves."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from glotouch_bt.commands.shared import (
    AllowPaths,
    Backend,
    Json,
    Objects,
    Settings,
    WorldName,
    guarded,
    print_json,
    read_settings,
)


@guarded
def check(
    missions: Annotated[list[str], typer.Argument(metavar="MISSION", help="mission files or shipped names")],
    set_: Settings = None,
    objects: Objects = None,
    world: WorldName = None,
    allow_path: AllowPaths = None,
    backend: Backend = "mujoco",
    strict: Annotated[bool, typer.Option("--strict", help="treat warnings as errors")] = False,
    json_: Json = False,
) -> int:
    """Check missions against every outcome of every skill.

    The arm must reach the box, the objects must fit into it, and the target between the jaws. Each mistake is shown
    with its line, the reason and the shortest run that reaches it. Nothing moves.
    """
    from glotouch_bt.mission import check_feasible, load_mission, split_settings
    from glotouch_bt.mission.nodes import kind_of
    from glotouch_bt.mission.spec import Finding, Findings, MissionFaults, Place
    from glotouch_bt.robot import BadInput

    settings = read_settings(set_)
    reports: list[dict[str, object]] = []
    for given in missions:
        found: list[Finding] = []
        report: dict[str, object] = {"mission": given, "ok": True}
        summary = ""
        try:
            mission = load_mission(given, settings, objects=objects, world=world, allow_paths=allow_path or ())
        except MissionFaults as e:
            found = [*e.findings, *e.warnings]
        except BadInput as e:
            unreadable = Finding(Place(given), "unreadable", str(e)).as_dict()
            reports.append({**report, "ok": False, "findings": [unreadable]})
            if not json_:
                sys.stderr.write(f"{e}\n")
            continue
        else:
            options = split_settings(mission, settings)
            found = [*mission.warnings, *check_feasible(mission, backend, options)]
            left = ", ".join(
                f"{name}; did you mean {near!r}?" if (near := Findings.nearest(name, mission.parameters)) else name
                for name in options
            )
            nodes, runs = sum(1 for _ in mission.spec.walk()), kind_of(mission.spec).max_runs(mission.spec)
            report |= {"nodes": nodes, "skill_runs": str(runs), "timeout_s": mission.timeout_s}
            items = ", n items a for_each" if len(runs.terms) > 1 else ""
            summary = f"{nodes} nodes; at most {runs} skill runs{items}; {mission.timeout_s:g} s"
            summary += f" (for the backend, because the mission does not declare them: {left})" if left else ""
        errors = [f for f in found if f.severity == "error" or strict]
        report |= {"ok": not errors, "findings": [f.as_dict() for f in found]}
        reports.append(report)
        if not json_:
            _show(given, found, summary, ok=not errors)
    ok = all(r["ok"] for r in reports)
    if json_:
        print_json({"ok": ok, "missions": reports})
    return 0 if ok else 2


def _show(given: str, found: Sequence[object], summary: str, *, ok: bool) -> None:
    from glotouch_bt.commands.terminal import print_findings, texts_of
    from glotouch_bt.mission.read import shipped_root
    from glotouch_bt.mission.spec import Finding

    findings = [f for f in found if isinstance(f, Finding)]
    print_findings(findings, texts_of({f.place.file for f in findings if f.place.line}, shipped_root()))
    counts = [(sum(f.severity == s for f in findings), s) for s in ("error", "warning")]
    counted = ", ".join(f"{n} {word}{'s' if n != 1 else ''}" for n, word in counts if n)
    if ok:
        sys.stdout.write(f"{given}: ok, {summary}{f'; {counted}' if counted else ''}\n")
    else:
        sys.stderr.write(f"{given}: {counted}\n")
