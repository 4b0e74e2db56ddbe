"""Tables of `glotouch bench faults`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.commands.terminal.console import print_table


def rate_text(rate: Mapping[str, Any]) -> str:
    """Return a rate with its interval and number of trials."""
    if not rate["n"]:
        return "none"
    return f"{100 * rate['rate']:.1f} % ({100 * rate['lo']:.1f} .. {100 * rate['hi']:.1f}, n = {rate['n']})"


def print_faults(summary: Mapping[str, Any], out: Path) -> None:
    """Print the matrix by fault, then the rates."""
    from glotouch_bt.validation.faults import VERDICTS

    rows = []
    for name, found in summary["by_class"].items():
        counts = [str(found[v] or "") for v in VERDICTS]
        rows.append((name, *counts, f"{found['named']} of {found['ended']}" if found["ended"] else ""))
    print_table("faults", ("class", *VERDICTS, "cause named"), rows)
    lines = (
        ("trials", f"{summary['trials']}, and {summary['twins_succeeded']} of {summary['twins']} twins succeeded"),
        ("hard limit broken", f"{summary['hard_limit_broken']} (largest peak {summary['largest_peak_force_N']:.1f} N)"),
        ("tracebacks, hangs, lost", f"{summary['tracebacks']}, {summary['hangs']}, {summary['lost']}"),
        ("wrong object lifted", rate_text(summary["wrong_object"])),
        ("cause named", rate_text(summary["named"])),
        ("recoverable recovered", rate_text(summary["recovered"])),
        ("no effect", "; ".join(summary["altered_nothing"]) or "none"),
    )
    for name, text in lines:
        sys.stdout.write(f"{name:22s} {text}\n")
    sys.stdout.write(f"{out / 'summary.json'}\n")


def print_exhaustive(summary: Mapping[str, Any], out: Path) -> None:
    """Print the number of failed calls, and the runs that did not end safely."""
    sys.stdout.write(f"{summary['mission']} on {summary['backend']} ({summary['unfaulted']} if nothing fails): ")
    sys.stdout.write(f"{summary['tried']} runs, in each of which one of {summary['calls']} calls failed: ")
    sys.stdout.write(f"{len(summary['bad'])} did not end with the arm held and the reason named\n")
    for bad in summary["bad"][:20]:
        sys.stdout.write(f"  {bad['fault']} at call {bad['call']}: {bad['what']}\n")
    sys.stdout.write(f"{out / 'summary.json'}\n")
