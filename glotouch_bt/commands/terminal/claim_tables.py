"""The list of figures of `bench all`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from glotouch_bt.commands.terminal.console import EscapingConsole


def minutes(value: float) -> str:
    """Return a wall time in words, from minutes."""
    if value < 1:
        return f"{60 * value:.0f} s"
    return f"{value:.0f} min" if value < 100 else f"{value / 60:.1f} h"


def print_claims(rows: Sequence[dict[str, Any]]) -> None:
    """Print the figures in their order, each with its expected wall time and its commands."""
    console = EscapingConsole()
    left = 0.0
    for n, row in enumerate(rows, 1):
        left += 0.0 if row["done"] else row["minutes"]
        state = "done" if row["done"] else minutes(row["minutes"])
        console.plain(f"{n:3} {row['name']}: {row['title']} ({state})")
        parts = f"   for {', '.join(row['parts'])}" if row["parts"] else ""
        for line in row["commands"]:
            console.plain(f"      {line}{parts}", "dim")
    console.print(f"{minutes(left)} left on two cores, as estimated from earlier campaigns", highlight=False)
