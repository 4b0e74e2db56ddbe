"""Progress of a run on stderr: three live lines on a terminal, one plain line for each skill elsewhere."""

from __future__ import annotations

import statistics
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Group
from rich.live import Live
from rich.markup import escape
from rich.text import Text

from glotouch_bt.commands.terminal.console import EscapingConsole

if TYPE_CHECKING:
    from glotouch_bt.mission import Mission
    from glotouch_bt.mission.record import RunSummary

REFRESH_S = 0.1
"""Wall time between two drawings. Source: ours."""
EARLIER_RUNS = 20
"""Maximum number of earlier runs of which the median duration is taken."""
PHASES = {"pause": ("pausing", "yellow"), "paused": ("PAUSED", "bold yellow")}
"""Word and colour of the phase after an event; otherwise the mission runs."""


class RunProgress:
    """Progress on stderr. Use as a context manager.

    Args:
        quiet: Print nothing.
    """

    def __init__(self, quiet: bool) -> None:
        self._console = EscapingConsole(stderr=True)
        self._quiet = quiet
        self._live: Live | None = None
        self._began_s = self._shown_s = 0.0
        self._last_node = ""
        self._parts: dict[str, str] = {}
        self._objects = ""
        self._usual_s: float | None = None

    def __enter__(self) -> RunProgress:
        return self

    def __exit__(self, *exc: object) -> None:
        if self._live is not None:
            self._live.stop()

    def start(self, mission: Mission, folder: Path) -> None:
        """Print the mission and its folder; call when the backend is open."""
        if self._quiet:
            return
        self._began_s = time.perf_counter()
        expected = mission.parameters.get("expected_objects")
        self._objects = f" of {expected}" if isinstance(expected, int) else ""
        self._parts = {
            path: node.name for path, node in mission.spec.paths(mission.name).items() if node.kind == "subtree"
        }
        head = f"[bold]{escape(mission.name)}[/] in {escape(mission.world.name)} -> {escape(str(folder))}"
        self._console.print(head, soft_wrap=True)
        if self._console.is_terminal:
            self._usual_s = usual_duration_s(folder, mission.name)
            # Other writers are not redirected: rich would execute their escape sequences.
            self._live = Live(
                console=self._console, auto_refresh=False, transient=True, redirect_stdout=False, redirect_stderr=False
            )
            self._live.start()

    def update(self, robot_s: float, summary: RunSummary) -> None:
        """Show phase, running skill, counts, the best candidate and the times."""
        if self._quiet:
            return
        now = time.perf_counter()
        node = _leaf(summary)
        if self._live is not None:
            if now - self._shown_s >= REFRESH_S:
                self._shown_s = now
                self._live.update(self._lines(robot_s, now - self._began_s, summary), refresh=True)
        elif node != self._last_node:
            self._last_node = node
            line = (
                f"t = {robot_s:6.1f} s  {node:<14} contacts {summary.contacts:3d}  objects {len(summary.candidates):2d}"
            )
            self._console.plain(line + _best(summary))

    def _lines(self, robot_s: float, wall_s: float, summary: RunSummary) -> Group:
        """Return the lines of a terminal."""
        word, colour = PHASES.get(summary.last_event[1], ("running", "green"))
        doing = Text.assemble((f"{word:<8}", colour), *self._place(summary), no_wrap=True, overflow="ellipsis")
        objects = f"{len(summary.candidates)}{self._objects}"
        facts = f"        contacts {summary.contacts}   objects {objects}{_best(summary)}"
        speed = robot_s / wall_s if wall_s > 0.5 else 0.0
        times = f"        robot {_clock(robot_s)}   wall {_clock(wall_s)}" + (f" ({speed:.0f}x)" if speed else "")
        if self._usual_s is not None and speed:
            times += f"   about {_clock(max(self._usual_s - robot_s, 0.0) / speed)} left"
        keys = f"   p {'goes on' if word == 'PAUSED' else 'pauses'}, Ctrl-C ends"
        return Group(
            doing,
            Text(facts, no_wrap=True, overflow="ellipsis"),
            Text.assemble(times, (keys, "dim"), no_wrap=True, overflow="ellipsis"),
        )

    def _place(self, summary: RunSummary) -> list[tuple[str, str]]:
        """Return the part of the mission, a subtree, and the running skill."""
        path = summary.node
        cuts = [i for i, c in enumerate(path) if c == "/"]
        part = next((self._parts[path[:i]] for i in cuts if path[:i] in self._parts), "")
        return [*([(part, ""), (" › ", "dim")] if part else []), (_leaf(summary), "bold")]


def _leaf(summary: RunSummary) -> str:
    """Return the name of the running leaf, without the number that only tells it from others in the tree."""
    name, skill = summary.node.rsplit("/", 1)[-1], summary.skill
    return skill if skill and name.removeprefix(skill).strip().isdigit() else name


def usual_duration_s(folder: Path, mission: str) -> float | None:
    """Return the median robot time of the newest successful runs of a mission beside a run's folder, or None."""
    from glotouch_bt.robot import BadInput
    from glotouch_bt.untrusted import read_json

    found = []
    for path in sorted(folder.parent.glob("*/result.json"), key=lambda p: p.stat().st_mtime)[-EARLIER_RUNS:]:
        try:
            result = read_json(path)
        except BadInput:
            continue
        if isinstance(result, dict) and (result.get("mission"), result.get("status")) == (mission, "success"):
            seconds = result.get("sim_time_s")
            found += [float(seconds)] if isinstance(seconds, int | float) else []
    return statistics.median(found) if found else None


def _best(summary: RunSummary) -> str:
    index, share = summary.best
    return f"   candidate {index}: {100 * share:.0f} %" if index >= 0 else ""


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
