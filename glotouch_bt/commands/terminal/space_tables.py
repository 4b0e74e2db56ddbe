"""Tables of `bench space`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from glotouch_bt.commands.terminal.console import EscapingConsole, print_table


def print_space(summary: dict[str, Any], folder: Path) -> None:
    """Print what became of pushed and of carried objects: position errors, toppled ones, forces, causes."""

    def rate(r: dict[str, Any]) -> str:
        if not r["n"]:
            return "-"
        return f"{r['rate'] * r['n']:.0f}/{r['n']}  {100 * r['rate']:.1f} % [{100 * r['lo']:.1f}, {100 * r['hi']:.1f}]"

    def spread(q: dict[str, Any]) -> str:
        return "-" if q["median"] is None else f"{q['median']:.1f}, {q['p95']:.1f}, {q['max']:.1f}"

    def over_worlds(m: dict[str, Any]) -> str:
        return f"{100 * m['mean']:.1f} % [{100 * m['lo']:.1f}, {100 * m['hi']:.1f}]" if m["n"] else "-"

    seeds = summary["seeds"]
    columns = [summary[act] for act in ("nudge", "clear") if act in summary]
    rows = [
        ("objects moved as asked", *(rate(c["done"]) for c in columns)),
        ("the same, of those that were touched", *(rate(c["done_of_tried"]) for c in columns)),
        (f"within {summary['within_mm']:g} mm of the map after the act", *(rate(c["within"]) for c in columns)),
        ("the same, interval over layouts", *(over_worlds(c["within_over_worlds"]) for c in columns)),
        ("of the others, as far off before", *(str(c["off_before"]) for c in columns)),
        ("within, at the end of the mission", *(rate(c["within_at_end"]) for c in columns)),
        ("position error, mm: median, 95 %, largest", *(spread(c["position_error_mm"]) for c in columns)),
        ("toppled", *(rate(c["toppled"]) for c in columns)),
        ("fallen before, not counted", *(str(c["fallen_before"]) for c in columns)),
        ("wrist force, N: median, 95 %, largest", *(spread(c["peak_N"]) for c in columns)),
        ("largest true peak force, N", *(f"{c['largest_peak_force_N']:.1f}" for c in columns)),
        ("safety stops", *(rate(c["safety_stops"]) for c in columns)),
    ]
    acts = [act for act in ("nudge", "clear") if act in summary]
    title = f"space for the fingers, {summary['conditions']}, seeds {seeds[0]}-{seeds[-1]}"
    print_table(title, ("rate [Wilson 95 %]", *acts), rows)
    for act, column in zip(acts, columns, strict=True):
        for what in ("not_done", "worlds_failed"):
            if column[what]:
                head = ("objects that were not moved" if what == "not_done" else "layouts", "count")
                print_table(f"{act}: {what.replace('_', ' ')}", head, [(c, str(n)) for c, n in column[what].items()])
    EscapingConsole().plain(f"{folder / 'summary.json'}")
