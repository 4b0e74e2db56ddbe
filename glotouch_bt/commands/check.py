"""`glotouch check`: prove missions before anything moves. `glotouch bench check`: what it finds of seeded mistakes."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.doctor import Json
from glotouch_bt.commands.options import read_settings
from glotouch_bt.commands.terminal import guarded


@guarded
def check(
    missions: Annotated[list[str], typer.Argument(metavar="MISSION...", help="mission files or shipped names")],
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter or backend option")
    ] = None,
    objects: Annotated[
        Path | None, typer.Option("--objects", metavar="DIR", help="folder of watertight STL files in metres")
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="warnings count as faults")] = False,
    json_: Json = False,
) -> int:
    """Prove missions before anything moves: every fault on any outcome of any skill, with the run that shows it."""
    from glotouch_bt.mission import load_mission, split_settings
    from glotouch_bt.mission.nodes import kind_of
    from glotouch_bt.mission.spec import Finding, Findings, MissionFaults, Place
    from glotouch_bt.robot import BadInput

    settings = read_settings(set_)
    reports: list[dict[str, object]] = []
    for given in missions:
        found: list[Finding] = []
        report: dict[str, object] = {"mission": given, "ok": True}
        said = ""
        try:
            mission = load_mission(given, settings, objects=objects)
        except MissionFaults as e:
            found = [*e.findings, *e.warnings]
        except BadInput as e:
            unreadable = Finding(Place(given), "unreadable", str(e)).as_dict()
            reports.append({**report, "ok": False, "findings": [unreadable]})
            if not json_:
                sys.stderr.write(f"{e}\n")
            continue
        else:
            found = list(mission.warnings)
            left = ", ".join(
                f"{name}; did you mean {near!r}?" if (near := Findings.nearest(name, mission.parameters)) else name
                for name in split_settings(mission, settings)
            )
            nodes, runs = sum(1 for _ in mission.tree.walk()), kind_of(mission.tree).max_runs(mission.tree)
            report |= {"nodes": nodes, "skill_runs": str(runs), "timeout_s": mission.timeout_s}
            items = ", n items a for_each" if len(runs.terms) > 1 else ""
            said = f"{nodes} nodes; at most {runs} skill runs{items}; {mission.timeout_s:g} s"
            said += f" (not parameters of it, for the backend: {left})" if left else ""
        errors = [f for f in found if f.severity == "error" or strict]
        report |= {"ok": not errors, "findings": [f.as_dict() for f in found]}
        reports.append(report)
        if not json_:
            _show(given, found, said, ok=not errors)
    ok = all(r["ok"] for r in reports)
    if json_:
        sys.stdout.write(json.dumps({"ok": ok, "missions": reports}, indent=2) + "\n")
    return 0 if ok else 2


def _show(given: str, found: Sequence[object], said: str, *, ok: bool) -> None:
    from glotouch_bt.commands.terminal import print_findings, texts_of
    from glotouch_bt.mission.read import shipped_root
    from glotouch_bt.mission.spec import Finding

    findings = [f for f in found if isinstance(f, Finding)]
    print_findings(findings, texts_of({f.place.file for f in findings}, shipped_root()))
    counts = [(sum(f.severity == s for f in findings), s) for s in ("error", "warning")]
    told = ", ".join(f"{n} {word}{'s' if n != 1 else ''}" for n, word in counts if n)
    if ok:
        sys.stdout.write(f"{given}: ok, {said}{f'; {told}' if told else ''}\n")
    else:
        sys.stderr.write(f"{given}: {told}\n")


@guarded
def bench_check(
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="write summary.json and table.md there")] = None,
    json_: Json = False,
) -> None:
    """Seeded mistakes: what `check` finds, what py_trees finds by itself, false alarms on missions that are right."""
    from glotouch_bt.robot import BadInput
    from glotouch_bt.validation.seeded_mistakes import as_markdown, compare, summary

    rows = compare()
    counted = summary(rows)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
            (out / "summary.json").write_text(json.dumps(counted, indent=2) + "\n", encoding="utf-8")
            (out / "table.md").write_text(as_markdown(rows), encoding="utf-8")
        except OSError as e:
            raise BadInput(f"--out {out}: cannot be written ({e.strerror})") from e
    if json_:
        sys.stdout.write(json.dumps(counted, indent=2) + "\n")
        return
    sys.stdout.write(as_markdown(rows) + "\n" + "".join(f"{k}: {v}\n" for k, v in counted.items()))
