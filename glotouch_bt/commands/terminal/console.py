"""What the command line prints: errors, progress, the end of a run, tables. Imported only when something is printed."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from glotouch_bt.mission import Mission
    from glotouch_bt.mission.record import RunSummary
    from glotouch_bt.run import RunResult

REFRESH_S = 0.1


def print_error(message: str) -> None:
    """One message on stderr, as it is (no markup, no wrapping)."""
    sys.stderr.write(f"glotouch: {message}\n")


class RunProgress:
    """A live line on a terminal, plain lines elsewhere; on stderr. Use as a context manager."""

    def __init__(self, quiet: bool) -> None:
        self._console = Console(stderr=True)
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
        """The backend is open; the mission begins."""
        if self._quiet:
            return
        self._console.print(f"[bold]{escape(mission.name)}[/] in {escape(mission.world.name)} -> {escape(str(folder))}")
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()

    def update(self, robot_s: float, summary: RunSummary) -> None:
        """Show where the run is."""
        if self._quiet:
            return
        node = summary.node.rsplit("/", 1)[-1]
        line = (
            f"t = {robot_s:6.1f} s  {node:<14} contacts {summary.contacts:3d}  candidates {len(summary.candidates):2d}"
        )
        if summary.last_event[1] in ("pause", "paused"):
            line += "  PAUSED (p goes on)" if summary.last_event[1] == "paused" else "  pausing"
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
    """The end of a run: what was retrieved, or why not, and where the report is."""
    console = Console()
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
    for fault in r.get("faults", ()):
        console.print(_fault_in_words(fault), markup=False, highlight=False, soft_wrap=True)
    if done.report is not None:
        console.print(f"report: {done.report}", markup=False, highlight=False, soft_wrap=True)
    else:
        console.print(f"record: {done.folder}", markup=False, highlight=False, soft_wrap=True)


def _fault_in_words(fault: Mapping[str, Any]) -> str:
    """What became of a fault of the plan; one that altered nothing has tested nothing."""
    if not fault["effective"]:
        why = "it began, and found nothing to alter" if fault["applied"] else "its moment never came"
        return f"fault {fault['name']}: ALTERED NOTHING: {why}; this run says nothing about it"
    seen = fault["seen"]
    told = (
        "nobody saw it" if seen is None else f"seen by {seen['by']} ({seen['code']}) after {fault['latency_s']:.2f} s"
    )
    applied = fault["applied"]
    return f"fault {fault['name']}: began {applied} time{'' if applied == 1 else 's'}, {told}"


def print_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table on stdout; cells are plain text."""
    console = Console()
    table = Table(title=title, title_justify="left", header_style="bold", show_edge=False)
    for i, name in enumerate(head):
        table.add_column(name, overflow="fold", no_wrap=i == 0)
    for row in rows:
        table.add_row(*(escape(c) for c in row))
    console.print(table)


def print_skills(described: Sequence[dict[str, Any]]) -> None:
    """One line a skill."""
    rows = [
        (
            d["name"],
            ", ".join(p["key"] for p in d["inputs"]),
            ", ".join(p["key"] for p in d["outputs"]),
            d["description"].split("\n", 1)[0],
        )
        for d in described
    ]
    print_table("skills", ("name", "reads", "writes", "what it does"), rows)


def print_skill(d: dict[str, Any]) -> None:
    """One skill in full."""
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
    print_table("parameters", ("name", "type", "unit", "default", "range", "what it is"), rows)
    ports = [("in", p["name"], p["type"], p["key"], p["description"]) for p in d["inputs"]]
    ports += [("out", p["name"], p["type"], p["key"], p["description"]) for p in d["outputs"]]
    sys.stdout.write("\n")
    sys.stdout.flush()
    print_table("ports", ("", "name", "type", "key", "what it is"), ports)
