"""Errors, progress and result of a run, tables, skills."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from glotouch_bt.escaped_text import visible

if TYPE_CHECKING:
    from glotouch_bt.mission import Mission
    from glotouch_bt.mission.record import RunSummary
    from glotouch_bt.runs import RunResult

REFRESH_S = 0.1


class EscapingConsole(Console):
    """The console of all commands: control characters in texts are shown; only its own styles reach the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """See `Console`."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)


def print_error(message: str) -> None:
    """Print one message on stderr without markup or wrapping."""
    sys.stderr.write(f"glotouch: {message}\n")


class RunProgress:
    """Progress on stderr: a live line on a terminal, plain lines elsewhere. Use as a context manager."""

    def __init__(self, quiet: bool) -> None:
        self._console = EscapingConsole(stderr=True)
        self._quiet = quiet
        self._live: Live | None = None
        self._shown_s = 0.0
        self._last_node = ""

    def __enter__(self) -> RunProgress:
        return self

    def __exit__(self, *exc: object) -> None:
        if self._live is not None:
            self._live.stop()

    def start(self, mission: Mission, folder: Path) -> None:
        """Print the mission and its folder; call when the backend is open."""
        if self._quiet:
            return
        self._console.print(f"[bold]{escape(mission.name)}[/] in {escape(mission.world.name)} -> {escape(str(folder))}")
        if self._console.is_terminal:
            # Other writers are not redirected: rich would execute their escape sequences.
            self._live = Live(
                console=self._console, auto_refresh=False, transient=True, redirect_stdout=False, redirect_stderr=False
            )
            self._live.start()

    def update(self, robot_s: float, summary: RunSummary) -> None:
        """Show the running node and the counts."""
        if self._quiet:
            return
        node = summary.node.rsplit("/", 1)[-1]
        line = (
            f"t = {robot_s:6.1f} s  {node:<14} contacts {summary.contacts:3d}  candidates {len(summary.candidates):2d}"
        )
        if summary.last_event[1] in ("pause", "paused"):
            line += "  PAUSED (p continues)" if summary.last_event[1] == "paused" else "  pausing"
        else:
            line += f"  last: {summary.last_event[1]}" if summary.last_event[1] else ""
        now = time.perf_counter()
        if self._live is not None:
            if now - self._shown_s >= REFRESH_S:
                self._shown_s = now
                self._live.update(Text(line), refresh=True)
        elif node != self._last_node:
            self._last_node = node
            self._console.print(line, markup=False, highlight=False)


def print_result(done: RunResult) -> None:
    """Print the end of a run: the retrieved object or the reasons, the faults, the path of the report."""
    console = EscapingConsole()
    r = done.result
    head = {"success": "[bold green]done[/]", "failure": "[bold red]failed[/]"}.get(
        str(r["status"]), "[bold red]aborted[/]"
    )
    speed = r["sim_time_s"] / r["wall_time_s"] if r["wall_time_s"] else 0.0
    console.print(
        f"{head}  {escape(str(r['mission']))}, seed {r['seed']}: {r['sim_time_s']:.1f} s of robot time in "
        f"{r['wall_time_s']:.1f} s ({speed:.0f}x), peak force {r['peak_force_N']:.1f} N",
        highlight=False,
        soft_wrap=True,
    )
    expected = r["parameters"].get("expected_objects")
    if expected is not None:
        found = len(r["candidates"])
        colour = "green" if found == expected else "yellow"
        console.print(f"objects found: [{colour}]{found} of {expected}[/] expected", highlight=False)
    if r["correct"] is not None:
        held = r["retrieved"] or "nothing"
        word = "[green]the target[/]" if r["correct"] else f"[red]not the target ({escape(str(r['target']))})[/]"
        console.print(f"in the gripper: [bold]{escape(str(held))}[/], {word}", highlight=False)
    for i, reason in enumerate(r["reasons"]):
        console.print(f"{'  ' * i}{'because ' if i else ''}{reason}", markup=False, highlight=False, soft_wrap=True)
    if r.get("ending"):
        console.print(str(r["ending"]), markup=False, highlight=False, soft_wrap=True)
    if r.get("unscored"):
        console.print(f"not scored: {r['unscored']}", markup=False, highlight=False, soft_wrap=True)
    for fault in r.get("faults", ()):
        console.print(_fault_in_words(fault), markup=False, highlight=False, soft_wrap=True)
    if done.report is not None:
        console.print(f"report: {done.report}", markup=False, highlight=False, soft_wrap=True)
    else:
        console.print(f"record: {done.folder}", markup=False, highlight=False, soft_wrap=True)


def _fault_in_words(fault: Mapping[str, Any]) -> str:
    """Return the result of one fault of the plan; a fault without effect makes the run useless as a test."""
    if not fault["effective"]:
        why = "it began but had nothing to change" if fault["applied"] else "its trigger never fired"
        return f"fault {fault['name']}: NO EFFECT: {why}; this run does not test it"
    seen = fault["seen"]
    times = "once" if fault["applied"] == 1 else f"{fault['applied']} times"
    detected = "not detected"
    if seen is not None:
        detected = f"detected by {seen['by']} ({seen['code']}) after {fault['latency_s']:.2f} s"
    return f"fault {fault['name']}: began {times}, {detected}"


def print_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table on stdout; cells are plain text."""
    console = EscapingConsole()
    table = Table(title=title, title_justify="left", header_style="bold", show_edge=False)
    for i, name in enumerate(head):
        table.add_column(name, overflow="fold", no_wrap=i == 0)
    for row in rows:
        table.add_row(*(escape(c) for c in row))
    console.print(table)


def print_settings(title: str, described: Sequence[Mapping[str, Any]]) -> None:
    """Print the table of described parameters or settings; nothing if there are none."""
    head = ("name", "type", "unit", "default", "range", "description")
    if described:
        print_table(title, head, [["" if d[key] is None else str(d[key]) for key in head] for d in described])


def print_skills(described: Sequence[dict[str, Any]]) -> None:
    """Print one line for each skill."""
    rows = [
        (
            d["name"],
            ", ".join(p["key"] for p in d["inputs"]),
            ", ".join(p["key"] for p in d["outputs"]),
            d["description"].split("\n", 1)[0],
        )
        for d in described
    ]
    print_table("skills", ("name", "reads", "writes", "description"), rows)


def print_skill(d: dict[str, Any]) -> None:
    """Print the full description of one skill."""
    sys.stdout.write(f"{d['name']}\n\n{d['description']}\n\n")
    rows = [
        (
            p["name"],
            p["type"],
            p["unit"],
            "required" if p["required"] else str(p["default"]),
            p["range"],
            p["description"],
        )
        for p in d["parameters"]
    ]
    print_table("parameters", ("name", "type", "unit", "default", "range", "description"), rows)
    ports = [("in", p["name"], p["type"], p["key"], p["description"]) for p in d["inputs"]]
    ports += [("out", p["name"], p["type"], p["key"], p["description"]) for p in d["outputs"]]
    sys.stdout.write("\n")
    sys.stdout.flush()
    print_table("ports", ("", "name", "type", "key", "description"), ports)
    sys.stdout.write("\n")
    sys.stdout.flush()
    failures = [(f["code"], f["meaning"], f["advice"]) for f in d["failures"]]
    print_table("failures", ("code", "meaning", "advice"), failures)
