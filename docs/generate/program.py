"""Pages on the program itself: the command line, the Python API, and what the body of a skill uses."""

from __future__ import annotations

import inspect
import re
import typing
from enum import Enum
from typing import Any

import typer
from markdown_text import NOTE, cell, code, prose, table

import glotouch_bt
from glotouch_bt.cli import app
from glotouch_bt.motion import Arm, MoveResult
from glotouch_bt.perception.recognition import Match
from glotouch_bt.perception.touch import Candidate, Contact, Contour, Layer, TouchSequence, TouchSet
from glotouch_bt.robot import Pose, SetPayload, Tare, World
from glotouch_bt.skill import Context
from glotouch_bt.skill.probing import HeldTool

MAX_WIDTH = 90
"""Characters of a signature on one line."""
CLI = """# Command line

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | the mission or a test failed, a replay differs, or `doctor` found a fault |
| 2 | bad input, such as a mission in which `check` finds an error; nothing moved |
| 3 | a safety stop, a backend failure or an internal error |
| 130 | Ctrl-C |

Results go to stdout, progress and messages to stderr. `--debug` shows the traceback of an error.
"""
API = """# Python API

These names are public: `import glotouch_bt as gt`. Everything else may change without notice. Writers of skills,
backends and mission tests also import from the doors of `glotouch_bt.skill`, `glotouch_bt.robot`,
`glotouch_bt.conformance` and `glotouch_bt.mission_testing`.
"""
MOTIONS = """# Inside a skill: motions and context

`self.context` is a [Context](#context), and `self.context.arm` has the motions. A motion is a generator: write
`result = yield from arm.shift(...)`. P is the mid-point between the pads, B the base of the arm. Options of all
Cartesian motions are those of [follow](#follow). To wait, `yield from arm.hold(0.4)`.

Slow requests go to the device: `ticket = self.context.requests.start(Tare())`, then
`yield from finish(ticket, "the tare")` with `finish` of `glotouch_skills.common.hand`.
"""


VALUES = """# Values of ports

Values that the shipped skills write to ports: `candidates` is a tuple of [Candidate](#candidate), `touchsets` one of
[TouchSet](#touchset), `tool` a [HeldTool](#heldtool). Lengths are in metres; names say unit and frame: K is the
container, P the mid-point between the pads. So the centre of the first object in the box is
`self.candidates[0].contour.centre_K_m`.
"""


def pages() -> dict[str, str]:
    """Return the pages by their path below docs/."""
    texts = {"cli": cli(), "motions": motions(), "values": values(), "api": api()}
    return {f"reference/{name}.md": NOTE + text.rstrip() + "\n" for name, text in texts.items()}


def cli() -> str:
    """Return the page on the commands, from the program's own help."""
    root: Any = typer.main.get_command(app)
    found = list(_commands(root, "glotouch"))
    rows = [(f"[`{name}`](#{_anchor(name)})", (c.help or "").split("\n")[0]) for name, c in found]
    text = [CLI, table(("command", "what it does"), rows)]
    for name, command in found:
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        usage = " ".join([name, *(_argument(p) for p in arguments), "[OPTIONS]"])
        text.append(f"## {name}\n\n    {usage}\n\n{prose(command.help or '')}\n")
        options = [
            (code(_option(p)), _shown_default(p), getattr(p, "help", "") or "")
            for p in command.params
            if p.name != "help" and not getattr(p, "hidden", False)
        ]
        text.append(table(("argument, option", "default", "meaning"), options))
    return "\n".join(t for t in text if t)


def _commands(group: Any, above: str) -> typing.Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if getattr(command, "hidden", False):
            continue
        full = f"{above} {name}"
        if hasattr(command, "commands"):
            yield from _commands(command, full)
        else:
            yield full, command


def _anchor(name: str) -> str:
    return name.replace(" ", "-")


def _argument(p: Any) -> str:
    name = (p.metavar or p.name.upper()).rstrip(".")
    return f"{name}{'...' if p.nargs == -1 else ''}" if p.required else f"[{name}{'...' if p.nargs == -1 else ''}]"


def _option(p: Any) -> str:
    if p.param_type_name == "argument":
        return _argument(p)
    kind = "" if p.is_flag else p.metavar or _kind(p.type_descriptor.annotation)
    return " ".join(w for w in ("/".join([*p.opts, *p.secondary_opts]), kind) if w)


def _kind(annotation: Any) -> str:
    """Return what an option takes: the choices of an enumeration, or the type in capitals."""
    inner = (typing.get_args(annotation) or (annotation,))[0]
    if inspect.isclass(inner) and issubclass(inner, Enum):
        return "|".join(str(m.value) for m in inner)
    return str(getattr(inner, "__name__", inner)).upper()


def _shown_default(p: Any) -> str:
    value = getattr(p.default, "value", p.default)
    if callable(value) or value in (None, False, (), []) or "Sentinel" in type(value).__name__:
        return ""
    return code(value)


def api() -> str:
    """Return the page on the names of `glotouch_bt.__all__`."""
    text = [API]
    for name in sorted(getattr(glotouch_bt, "__all__", ()), key=str.lower):
        found = getattr(glotouch_bt, name)
        if inspect.isclass(found):
            text += _class(name, found, [(m, f) for m, f in _members(found)])
        elif callable(found):
            text.append(f"## {name}\n\n    {_signature(name, found)}\n\n{prose(found.__doc__ or '')}\n")
        elif inspect.ismodule(found) or not isinstance(found, str):
            doc = getattr(found, "__doc__", "") or ""
            same = doc == type(found).__doc__  # an instance of a class that has its own entry
            text.append(f"## {name}\n\n{code(repr(found)) if same else cell(prose(doc))}\n")
    return "\n".join(t for t in text if t)


def _class(name: str, kind: type, members: list[tuple[str, Any]]) -> list[str]:
    rows = [(code(m + _call(f)), prose(f.__doc__ or "").split("\n\n")[0]) for m, f in members]
    heading = f"## {name}\n\n    {_signature('class ' + name, kind)}\n\n{prose(kind.__doc__ or '')}\n"
    return [heading, table(("member", "what it does"), rows)]


def motions() -> str:
    """Return the page on what the body of a skill uses: the arm's motions, requests, and the context."""
    text = [MOTIONS]
    for name in ("transit", "shift", "line", "arc", "joints", "jaws", "hold", "follow"):
        found = getattr(Arm, name)
        text.append(f"## {name}\n\n    {_signature(name, found)}\n\n{prose(found.__doc__ or '')}\n")
    for kind in (MoveResult, Context, Pose, Tare, SetPayload, World):
        text += _class(kind.__name__, kind, _members(kind))
    return "\n".join(t for t in text if t)


def values() -> str:
    """Return the page on the values that skills hand on through ports."""
    text = [VALUES]
    for kind in (Candidate, Contour, Contact, TouchSet, TouchSequence, Layer, Match, HeldTool):
        text += _class(kind.__name__, kind, _members(kind))
    return "\n".join(t for t in text if t)


def _signature(name: str, found: Any) -> str:
    try:
        shown = str(inspect.signature(found))
    except (TypeError, ValueError):
        shown = ""
    for prefix in ("glotouch_bt.", "collections.abc.", "pathlib.", "numpy.typing."):
        shown = shown.replace(prefix, "")
    shown = shown.replace("(self, ", "(")
    shown = re.sub(r"(: |-> )'([^']*)'", r"\1\2", shown)
    text = f"{name}{shown}"
    if len(text) <= MAX_WIDTH:
        return text
    inside, _, after = shown.removeprefix("(").rpartition(")")
    parts = re.split(r", (?=[*\w]+(?:: | = |$|,))", inside)
    return f"{name}(\n" + "".join(f"        {part},\n" for part in parts) + f"    ){after}"


def _members(kind: type) -> list[tuple[str, Any]]:
    """Public methods and properties that have a text of their own."""
    own = [(n, m) for n, m in vars(kind).items() if not n.startswith("_")]
    return [(n, m) for n, m in own if (callable(m) or isinstance(m, property | classmethod)) and m.__doc__]


def _call(member: Any) -> str:
    return "" if isinstance(member, property) else "()"
