"""The command line: build the app from the commands.

Exit codes: 0 done; 1 the mission failed; 2 bad input; 3 a safety stop or backend failure; 130 Ctrl-C.
"""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from glotouch_bt import __version__
from glotouch_bt.commands import COMMANDS, bench
from glotouch_bt.commands.shared import set_debug, with_bare_values
from glotouch_bt.interrupts import repeat_lost_interrupts
from glotouch_bt.lazy import collect_rarely


class GroupedHelp(TyperGroup):
    """A group whose help lists the commands by use."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one section for each use, with one line for each command."""
        width = max(len(name) for name in self.commands)
        for use, names in {**COMMANDS, "Measure": ("bench",)}.items():
            rows = [(n.ljust(width), self.commands[n].get_short_help_str(formatter.width)) for n in names]
            with formatter.section(use):
                formatter.write_dl(rows)


class BareOptions(TyperCommand):
    """A command in which some options may stand without their value."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words after the command's name."""
        return super().parse_args(ctx, with_bare_values(args))


app = typer.Typer(
    name="glotouch",
    help="Missions for robots that work by touch.",
    cls=GroupedHelp,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for _commands in COMMANDS.values():
    for _name, _command in _commands.items():
        app.command(_name, cls=BareOptions)(_command)
app.add_typer(bench)


def _print_version(wanted: bool) -> None:
    if wanted:
        sys.stdout.write(f"glotouch {__version__}\n")
        raise typer.Exit


@app.callback()
def _options(
    debug: Annotated[bool, typer.Option("--debug", help="show the traceback of an error")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="print the version", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    if debug:
        set_debug()


def _keep_called(name: str) -> None:
    """Leave the app only the command or group that is called, because Typer builds the options of all, 0.1 s."""
    commands = [c for c in app.registered_commands if c.name == name]
    groups = [g for g in app.registered_groups if g.typer_instance and g.typer_instance.info.name == name]
    if commands or groups:
        app.registered_commands, app.registered_groups = commands, groups


def main() -> None:
    """Run the `glotouch` command; `--debug` may stand anywhere."""
    if os.name != "posix":
        sys.exit("glotouch: this system is not supported: use Linux or macOS, or WSL 2 or Docker on Windows")
    if "--debug" in sys.argv[1:]:
        set_debug()
        sys.argv = [a for a in sys.argv if a != "--debug"]
    if sys.argv[1:]:
        _keep_called(sys.argv[1])
    collect_rarely()
    repeat_lost_interrupts()
    try:
        app()
    finally:  # the command is over: one more Ctrl-C must not end the interpreter's own clean-up
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    main()
