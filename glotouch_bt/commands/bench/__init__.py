"""`glotouch bench ...`: one file for each experiment."""

from __future__ import annotations

import typer

from glotouch_bt.commands.bench.check import check
from glotouch_bt.commands.bench.contact import contact
from glotouch_bt.commands.bench.detection import detection
from glotouch_bt.commands.bench.faults import faults
from glotouch_bt.commands.bench.forces import forces
from glotouch_bt.commands.bench.fuzz import fuzz
from glotouch_bt.commands.bench.link import link
from glotouch_bt.commands.bench.match import match
from glotouch_bt.commands.bench.pause import pause
from glotouch_bt.commands.bench.resume import resume
from glotouch_bt.commands.bench.retrieve import retrieve
from glotouch_bt.commands.bench.robustness import robustness
from glotouch_bt.commands.bench.search import search
from glotouch_bt.commands.bench.speed import speed

bench = typer.Typer(
    name="bench",
    help="Run experiments: many trials, confidence intervals, summary.json.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
for _experiment in (
    retrieve,
    search,
    match,
    robustness,
    contact,
    detection,
    speed,
    faults,
    forces,
    resume,
    pause,
    link,
    fuzz,
    check,
):
    bench.command()(_experiment)
