"""Findings of the checker: place, line of the mission, reason, and the shortest run that reaches the mistake."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from glotouch_bt.commands.terminal.console import EscapingConsole

if TYPE_CHECKING:
    from glotouch_bt.mission.spec import Finding

MAX_STEPS = 8
"""Number of steps to print of the part of a run in which every step succeeded."""
_COLOUR = {"error": "bold red", "warning": "bold yellow"}


def print_findings(findings: Iterable[Finding], lines: dict[str, list[str]]) -> None:
    """Print findings on stderr.

    Args:
        findings: In the order to print.
        lines: Lines of each file, by the name in the findings; a missing file is not quoted.
    """
    console = EscapingConsole(stderr=True, soft_wrap=True, highlight=False)
    for finding in findings:
        place, colour = finding.place, _COLOUR[finding.severity]
        head = Text(f"{place}: ", style="bold")
        head.append(f"{finding.severity}: ", style=colour).append(finding.what)
        if finding.hint:
            head.append("; did you mean ").append(repr(finding.hint), style="bold green").append("?")
        head.append(f" [{finding.code}]", style="dim")
        text = lines.get(place.file, [])
        if finding.kind.brief:
            console.print(head)
            continue
        if 0 < place.line <= len(text):
            quoted = text[place.line - 1].rstrip()
            shift = len(quoted) - len(quoted.lstrip())
            head.append(f"\n  {place.line:5d} | ", style="dim").append(quoted[shift:])
            head.append("\n        | ", style="dim").append(" " * (place.column - 1 - shift) + "^", style=colour)
        for word, said in (
            ("why", finding.kind.why),
            ("path", path_in_words(finding.path)),
            ("valid", finding.valid),
            ("fix", finding.kind.advice),
        ):
            if said:
                head.append(f"\n  {word:>5}   ", style="dim").append(said)
        console.print(head, "", sep="\n")


def path_in_words(path: tuple[str, ...]) -> str:
    """Return the steps of a run, without most of the early steps that succeeded; empty for a single step."""
    if len(path) < 2:
        return ""
    steps: list[str] = []
    for step in path:
        same = steps and steps[-1].partition(" ×")[0] == step
        times = int(steps.pop().partition(" ×")[2] or 1) + 1 if same else 1
        steps.append(f"{step} ×{times}" if times > 1 else step)
    odd = [i for i, s in enumerate(steps) if not (s.endswith((" ok", " holds", " has no item")))]
    first = min(odd, default=len(steps))
    if first > MAX_STEPS:
        steps = [steps[0], f"({first - MAX_STEPS // 2 - 1} more ok)", *steps[first - MAX_STEPS // 2 :]]
    return " > ".join(steps)


def texts_of(files: Iterable[str], root: Path) -> dict[str, list[str]]:
    """Return the lines of mission files by their name in messages (`glotouch_missions/...` for shipped files)."""
    from glotouch_bt.mission.read import MAX_BYTES
    from glotouch_bt.robot import BadInput
    from glotouch_bt.untrusted import read_file

    found: dict[str, list[str]] = {}
    for name in files:
        path = root / name.removeprefix("glotouch_missions/") if name.startswith("glotouch_missions/") else Path(name)
        try:
            found[name] = read_file(path, MAX_BYTES, links=True).decode().splitlines()
        except (BadInput, UnicodeDecodeError):
            continue
    return found
