"""Errors and result of a run, tables, skills."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.markup import escape
from rich.segment import Segment
from rich.table import Table

from glotouch_bt.escaped_text import visible

if TYPE_CHECKING:
    from glotouch_bt.runs import RunResult


class EscapingConsole(Console):
    """The console of all commands: control characters in texts are shown; only its own styles reach the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """See `Console`."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)

    def plain(self, text: str, style: str | None = None) -> None:
        """Print a text without markup, colours of its words or line breaks of the console's own."""
        self.print(text, style=style, markup=False, highlight=False, soft_wrap=True)


def print_error(message: str) -> None:
    """Print one message on stderr without markup or wrapping."""
    sys.stderr.write(f"glotouch: {message}\n")


def print_result(done: RunResult) -> None:
    """Print the end of a run: the reasons, the faults, the path of the report, and last the results."""
    console = EscapingConsole()
    r = done.result

    head = {"success": "[bold green]done[/]", "failure": "[bold red]failed[/]"}.get(
        str(r["status"]), "[bold red]aborted[/]"
    )
    speed = r["sim_time_s"] / r["wall_time_s"] if r["wall_time_s"] else 0.0
    felt, true = r["sensed_peak_force_N"], r.get("true_peak_force_N")
    peaks = [*([f"{felt:.1f} N felt"] if felt else []), *([] if true is None else [f"{true:.1f} N true"])]
    console.print(
        f"{head}  {escape(str(r['mission']))}, seed {r['seed']}: {r['sim_time_s']:.1f} s of robot time in "
        f"{r['wall_time_s']:.1f} s ({speed:.0f}x)" + (f", peak force {', '.join(peaks)}" if peaks else ""),
        highlight=False,
        soft_wrap=True,
    )
    for i, reason in enumerate(r["reasons"]):
        console.plain(f"{'  ' * i}{'because ' if i else ''}{reason}")
    if r.get("ending"):
        console.plain(str(r["ending"]))
    if r.get("unscored"):
        console.plain(f"not scored: {r['unscored']}")
    for fault in r.get("faults", ()):
        console.plain(_fault_in_words(fault))
    console.plain(f"record: {done.folder}" if done.report is None else f"report: {done.report}")
    for result in (r.get("results") or {}).values():
        console.plain(f"result: {result['text']}")
    expected = r["parameters"].get("expected_objects")
    if expected is not None:
        found = len(r["candidates"])
        colour = "green" if found == expected else "yellow"
        of = f"[{colour}]{found} of {expected}[/] expected" if isinstance(expected, int) else f"{found}"
        console.print(f"result: objects found: {of}", highlight=False)
    if r["correct"] is not None:
        held = r["retrieved"] or "nothing"
        word = "[green]the target[/]" if r["correct"] else f"[red]not the target ({escape(str(r['target']))})[/]"
        console.print(f"result: in the gripper: [bold]{escape(str(held))}[/], {word}", highlight=False)


def _fault_in_words(fault: Mapping[str, Any]) -> str:
    """Return the result of one fault of the plan; a fault without effect makes the run useless as a test."""
    if not fault["effective"]:
        why = "it began but had nothing to change" if fault["applied"] else "its trigger never fired"
        return f"fault {fault['name']}: NO EFFECT: {why}; this run does not test it"
    seen = fault["seen"]
    times = "once" if fault["applied"] == 1 else f"{fault['applied']} times"
    reaction = "no failure and no finding afterwards"
    if seen is not None:
        reaction = f"first reaction afterwards: {seen['by']} ({seen['code']}), {fault['latency_s']:.2f} s later"
    return f"fault {fault['name']}: began {times}; {reaction}"


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
    print_table("skills", ("name", "description"), [(d["name"], d["description"].split("\n", 1)[0]) for d in described])
    sys.stdout.write("glotouch skills NAME describes one: parameters, ports, states and failures\n")


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
