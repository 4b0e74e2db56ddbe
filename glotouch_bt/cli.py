"""The command line. Thin: it reads words, calls the house, prints, and turns errors into exit codes.

Exit codes: 0 done; 1 the mission failed; 2 bad input; 3 a safety stop or backend failure; 130 Ctrl-C.
Heavy imports stand inside the commands, so that `glotouch --help` is quick.
"""

from __future__ import annotations

import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands import (
    bench,
    bench_check,
    bench_faults,
    bench_fuzz,
    bench_pause,
    bench_resume,
    check,
    doctor,
    faults,
    link,
    mission_tests,
    read_settings,
    replay,
    resume,
)
from glotouch_bt.commands.terminal import guarded, set_debug

app = typer.Typer(
    name="glotouch",
    help="Missions for robots that work by touch.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
bench.command("link")(link)
bench.command("pause")(bench_pause)
bench.command("faults")(bench_faults)
bench.command("resume")(bench_resume)
bench.command("fuzz")(bench_fuzz)
app.command("doctor")(doctor)
app.command("check")(check)
bench.command("check")(bench_check)
app.command("test")(mission_tests)
app.command("replay")(replay)
app.command("resume")(resume)
app.command("faults")(faults)
app.add_typer(bench)


class TreeFormat(StrEnum):
    """How `glotouch tree` draws."""

    text = "text"
    svg = "svg"
    btcpp = "btcpp"


Mission = Annotated[
    str, typer.Argument(metavar="MISSION", help="path of a mission file, or the name of a shipped mission")
]
Sets = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter or backend option")
]
Objects = Annotated[
    Path | None, typer.Option("--objects", metavar="DIR", help="folder of watertight STL files in metres")
]
Json = Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")]


@app.callback()
def _options(debug: Annotated[bool, typer.Option("--debug", help="show the traceback of an error")] = False) -> None:
    if debug:
        set_debug()


def _print_json(data: object) -> None:
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False, default=str) + "\n")


@app.command()
@guarded
def run(
    mission: Mission,
    backend: Annotated[str, typer.Option(help="a registered backend (see: glotouch backends)")] = "mujoco",
    seed: Annotated[int, typer.Option(help="source of every random draw")] = 0,
    set_: Sets = None,
    objects: Objects = None,
    conditions: Annotated[str, typer.Option(help="disturbances: ideal, nominal, harsh, or a file")] = "nominal",
    faults: Annotated[str | None, typer.Option(metavar="FILE", help="a fault plan (see: glotouch faults)")] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="the run's folder (default: runs/...)")] = None,
    json_: Json = False,
) -> int:
    """Run a mission and write its record, result and report. `p` (or SIGUSR1) pauses it, SIGTERM ends it safely."""
    from glotouch_bt.commands.terminal import Operator, console, operated, tell_end
    from glotouch_bt.run import RunRequest, launch

    request = RunRequest(mission, backend, seed, read_settings(set_), objects, conditions, out, faults, may_kill=True)
    with console.RunProgress(quiet=json_) as progress, operated(Operator()) as control:
        done = launch(request, on_start=progress.start, on_progress=progress.update, control=control)
    return tell_end(done, json_)


@app.command()
@guarded
def skills(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one skill")] = None, json_: Json = False
) -> None:
    """List the installed skills, or describe one: parameters, units, ranges, ports."""
    from glotouch_bt.commands.terminal import console
    from glotouch_bt.mission.export import describe_skill
    from glotouch_bt.mission.read import SkillShelf

    shelf = SkillShelf()
    described = [describe_skill(n, shelf[n]) for n in ([name] if name else shelf)]
    if json_:
        _print_json(described[0] if name else described)
    elif name:
        console.print_skill(described[0])
    else:
        console.print_skills(described)


@app.command()
@guarded
def backends(json_: Json = False) -> None:
    """List the installed backends and whether they can be used here."""
    from glotouch_bt.commands.terminal import console
    from glotouch_bt.robot import BackendError, backend_entry_points, load_backend

    found: list[dict[str, Any]] = []
    for name in sorted(backend_entry_points()):
        try:
            found.append({"name": name, "usable": True, "summary": load_backend(name).summary})
        except BackendError as e:
            found.append({"name": name, "usable": False, "summary": str(e)})
    if json_:
        _print_json(found)
    else:
        rows = [(b["name"], "yes" if b["usable"] else "no", b["summary"]) for b in found]
        console.print_table("backends", ("name", "usable", "what it is"), rows)


@app.command()
@guarded
def tree(
    mission: Mission,
    format_: Annotated[TreeFormat, typer.Option("--format", help="how to draw it")] = TreeFormat.text,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="write there instead of stdout")] = None,
    set_: Sets = None,
    objects: Objects = None,
) -> None:
    """Draw a mission's tree."""
    from glotouch_bt.mission import load_mission
    from glotouch_bt.mission.export import as_btcpp, as_svg, as_text
    from glotouch_bt.robot import BadInput

    loaded = load_mission(mission, read_settings(set_), objects=objects)
    drawn = {TreeFormat.text: as_text, TreeFormat.svg: as_svg, TreeFormat.btcpp: as_btcpp}[format_](loaded)
    if out is None:
        sys.stdout.write(drawn)
        return
    try:
        out.write_text(drawn, encoding="utf-8")
    except OSError as e:
        raise BadInput(f"--out {out}: cannot be written ({e.strerror})") from e


@app.command()
@guarded
def report(folder: Annotated[Path, typer.Argument(metavar="RUN", help="a run's folder")], json_: Json = False) -> None:
    """Make report.html of a run again."""
    from glotouch_bt.report import write_report

    made = write_report(folder)
    if json_:
        _print_json({"report": str(made)})
    else:
        sys.stdout.write(f"{made}\n")


@app.command()
@guarded
def schema() -> None:
    """Print the JSON Schema of mission files, for editors."""
    from glotouch_bt.mission.export import mission_schema
    from glotouch_bt.mission.read import SkillShelf

    _print_json(mission_schema(SkillShelf()))


def main() -> None:
    """The `glotouch` command; `--debug` may stand anywhere."""
    if "--debug" in sys.argv[1:]:
        set_debug()
        sys.argv = [a for a in sys.argv if a != "--debug"]
    app()


if __name__ == "__main__":
    main()
