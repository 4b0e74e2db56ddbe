"""`glotouch bench ...`: one file for each experiment."""

from __future__ import annotations

import typer

from glotouch_bt.commands.bench.all_figures import all_
from glotouch_bt.commands.bench.compare import compare
from glotouch_bt.commands.bench.contact import contact
from glotouch_bt.commands.bench.dataset import dataset
from glotouch_bt.commands.bench.detection import detection
from glotouch_bt.commands.bench.executive import check, faults, forces, fuzz, link, pause, resume
from glotouch_bt.commands.bench.growth import growth
from glotouch_bt.commands.bench.match import match
from glotouch_bt.commands.bench.retrieve import retrieve
from glotouch_bt.commands.bench.robustness import robustness
from glotouch_bt.commands.bench.search import search
from glotouch_bt.commands.bench.space import space
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
    growth,
    match,
    robustness,
    contact,
    space,
    detection,
    speed,
    faults,
    forces,
    resume,
    pause,
    link,
    fuzz,
    check,
    dataset,
):
    bench.command()(_experiment)
bench.command("all")(all_)
bench.command()(compare)
