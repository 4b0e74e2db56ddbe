"""Tables of `bench compare`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from glotouch_bt.commands.terminal.console import EscapingConsole, print_table

NAMED = 8
"""Number of unpaired or turned trials that are named."""


def print_comparison(found: dict[str, Any]) -> None:
    """Print what differs between the campaigns, the paired figures, and the trials without a partner."""
    console = EscapingConsole()
    for side in ("a", "b"):
        c = found[side]
        commit = f", commit {c['commit']}" if c["commit"] else ""
        console.plain(f"{side.upper()}: {c['folder']} ({c['trials']} trials{commit})")
    rows = [(d["what"], _short(d["a"]), _short(d["b"])) for d in found["differs"]]
    print_table("what differs", ("", "A", "B"), rows or [("nothing: code, settings and objects are the same", "", "")])
    for label, group in found["groups"].items():
        name = f"{label}: " if label else ""
        rates = [
            (column, f"{100 * r['a']:.1f}", f"{100 * r['b']:.1f}", _difference(r, 100.0, 1),
             f"{r['only_a']} / {r['only_b']}", _p(r["mcnemar_p"]), str(r["worlds"]))
            for column, r in group["rates"].items()
        ]  # fmt: skip
        if rates:
            head = ("rate, %", "A", "B", "B - A [95 % over worlds]", "only A / only B", "McNemar p", "worlds")
            print_table(f"{name}{group['pairs']} pairs", head, rates)
        numbers = [
            (column, f"{m['a']:.4g}", f"{m['b']:.4g}", _difference(m), _p(m["p"]), str(m["n"]), str(m["worlds"]))
            for column, m in group["numbers"].items()
        ]
        if numbers:
            head = ("mean", "A", "B", "B - A [95 % over worlds]", "t-test p", "pairs", "worlds")
            print_table(f"{name}{group['pairs']} pairs", head, numbers)
    for side in ("a", "b"):
        _names(console, f"succeeds only in {side.upper()}", found["turned"][f"only_{side}"])
        _names(console, f"without a partner, only in {side.upper()}", found["unpaired"][side])
    for column, count in found["missing"].items():
        console.plain(f"{column}: {count} pairs have a value in one campaign only, and are left out")
    count = sum(len(g["rates"]) + len(g["numbers"]) for g in found["groups"].values())
    console.plain(f"{count} figures are compared: by chance, one in twenty lies outside its 95 % interval")


def _names(console: EscapingConsole, what: str, names: Sequence[str]) -> None:
    if names:
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        console.plain(f"{what}: {len(names)} ({', '.join(names[:NAMED])}{more})")


def _difference(m: dict[str, Any], factor: float = 1.0, digits: int = 3) -> str:
    """Return a difference with its interval; digits after the point, or significant ones for a factor of 1."""

    def number(value: float) -> str:
        return f"{factor * value:+.{digits}f}" if factor != 1.0 else f"{value:+.{digits}g}"

    interval = f" [{number(m['lo'])}, {number(m['hi'])}]" if m["worlds"] > 1 else ""
    return f"{number(m['difference'])}{interval}"


def _p(value: float) -> str:
    return "-" if value != value else f"{value:.2g}"


def _short(value: object) -> str:
    text = "none" if value is None else value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
