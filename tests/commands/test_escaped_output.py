"""Whatever a command prints, no control character of a name or an error reaches the terminal."""

from __future__ import annotations

import io
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import replace

import pytest
import typer

from glotouch_bt.commands.shared import guarded, print_json
from glotouch_bt.commands.shared.output import tolerant_streams
from glotouch_bt.commands.terminal import EscapingConsole, print_findings, print_table
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.export import as_btcpp, as_svg, as_text
from glotouch_bt.mission.spec import Finding, Place

ODD = "\x1b[31mred\x1b]8;;http://x\x07\u202e\x9b2J"
SHOWN = "\\x1b[31mred\\x1b]8;;http://x\\x07\\u202e\\x9b2J"


class Terminal(io.StringIO):
    """A terminal that keeps what it was sent."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


@contextmanager
def a_terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Terminal]:
    """Stand in for stdout and stderr; colours are on."""
    found = Terminal()
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "200")
    with redirect_stdout(found), redirect_stderr(found):
        yield found


def test_plain_text_and_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    @guarded
    def command() -> None:
        sys.stdout.write(ODD + "\n")
        print_json({"name": ODD})
        raise KeyError(ODD)

    with a_terminal(monkeypatch) as terminal, suppress(typer.Exit):
        command()
    said = terminal.getvalue()
    assert SHOWN in said
    assert "internal error: KeyError" in said
    assert not any(c in said for c in "\x1b\x07\u202e\x9b")


def test_text_that_rich_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    """The styles are rich's own; the text in them is shown."""
    with a_terminal(monkeypatch) as terminal, tolerant_streams():
        print_table(ODD, ("name",), [(ODD,)])
        EscapingConsole().print(f"[bold]{ODD}[/]")
        print_findings([Finding(Place("m.yaml", 1, 1), "wrong_name", ODD)], {"m.yaml": [ODD]})
    said = terminal.getvalue()
    assert said.count("\\x1b]8;;") >= 4
    assert "\x1b[1m" in said, "rich's own"
    assert not any(c in said for c in "\x07\u202e\x9b")
    assert "\x1b[31mred" not in said
    assert "\x1b]" not in said


def test_drawings_are_well_formed() -> None:
    mission = load_mission("calibrate")
    odd = replace(mission, name="m", description=ODD)
    odd.spec.name = f'{ODD}"<&'
    assert SHOWN in as_text(odd)
    for drawn in (as_svg(odd), as_btcpp(odd)):
        assert any(SHOWN in str(text) for e in ET.fromstring(drawn).iter() for text in (e.text, *e.attrib.values()))
