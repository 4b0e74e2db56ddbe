"""Tables of `glotouch bench forces`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.commands.terminal.console import print_table
from glotouch_bt.commands.terminal.fault_tables import rate_text

GROUPS = (
    ("by_scene", "mission and backend"),
    ("by_moment", "moment"),
    ("by_joint", "joint"),
    ("by_rate", "rate"),
)


def print_forces(summary: Mapping[str, Any], out: Path) -> None:
    """Print peaks and counts by group, the rates, and how to repeat each offending trial."""
    limit = summary["hard_force_N"]
    head = ("trials", "offending", "largest peak, N", "mean wall, s")
    for key, name in GROUPS[1:] if summary["by_moment"] else GROUPS[:1]:
        rows = []
        for title, group in summary[key].items():
            counts = str(group["trials"]), str(group["offending"] or "")
            rows.append((title, *counts, _force(group["largest_peak_force_N"]), f"{group['mean_wall_s']:.1f}"))
        if rows:
            print_table(summary["set"], (name, *head), rows)
    lines = (
        ("trials", f"{summary['trials']}, in {summary['several_effective']} of them several faults had an effect"),
        ("no effect", f"{len(summary['without_effect'])} more trials"),
        ("not started", f"{len(summary['not_started'])} more trials: the robot failed before the first tick"),
        ("refused plans", "; ".join(summary["refused"]) or "none"),
        (f"peak over {limit:g} N", rate_text(summary["over_hard_limit"])),
        ("false success", rate_text(summary["false_success"])),
        ("no result", rate_text(summary["no_result"])),
        ("true peak unknown", ", ".join(summary["true_peak_unknown"]) or "none"),
        ("ends", ", ".join(f"{n} {status}" for status, n in summary["ends"].items()) or "none"),
    )
    for name, text in lines:
        sys.stdout.write(f"{name:22s} {text}\n")
    sys.stdout.write("largest true peaks:\n")
    for row in summary["largest_peaks"][:5]:
        sys.stdout.write(f"  {_force(row['peak_force_N'])} N, {row['folder']}: {row['mission']}, {row['faults']}\n")
    for row in summary["offending"]:
        sys.stdout.write(f"OFFENCE: {', '.join(row['offences'])} ({row['folder']})\n  {row['command']}\n")
    sys.stdout.write(f"{out / 'summary.json'}\n")


def _force(peak: float | None) -> str:
    return "unknown" if peak is None else f"{peak:.1f}"
