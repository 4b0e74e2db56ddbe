"""Measure claims: run their commands one after another, each in a process and a folder of its own.

DIR/campaign.json            code, versions and scale: a folder holds figures of one state of the code
DIR/NAME/[PART/]             folder of the command (`--out`)
DIR/NAME/[PART/]output.txt   what the commands print on stdout
DIR/NAME/summary.json        the figures
DIR/NAME/done.json           written last: command lines, commit, exit codes, wall time
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from glotouch_bt.campaign import ROOT, commit_of_source, described_code, open_folder
from glotouch_bt.claims.table import Claim
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.runs import RunFolder
from glotouch_bt.untrusted import read_json

DONE = "done.json"
SUMMARY = "summary.json"
OUTPUT = "output.txt"
MANIFEST_SCALE = "scale"
"""Key of the scale in campaign.json."""
RESULTS = (0, 1)
"""Exit codes of a command that has a result; 1 is a result that is not as it should be."""


@dataclass(frozen=True)
class ClaimEnd:
    """The end of one claim.

    Attributes:
        name: Its name.
        wall_s: Wall time of this command; 0 if it was done before.
        failed: What went wrong, or None.
        before: It was done before.
    """

    name: str
    wall_s: float = 0.0
    failed: str | None = None
    before: bool = False


def run_claims(
    claims: Mapping[str, Claim],
    out: Path,
    *,
    scale: float = 1.0,
    more: Mapping[str, Collection[str]] | None = None,
    words: Sequence[str] = (),
    on_start: Callable[[str, str], object] = lambda name, line: None,
    on_end: Callable[[ClaimEnd], object] = lambda outcome: None,
) -> list[ClaimEnd]:
    """Run the commands of the claims that the folder does not hold yet. One that fails does not stop the others.

    Args:
        claims: The claims, by name.
        out: The folder; it is created, or continued.
        scale: Factor of the numbers of trials, above 0 and at most 1.
        more: Options that each bench takes, by its name: `--resume` and `words` are given to those that take them.
        words: Further options with their values, such as ("--workers", "4").
        on_start: Called with the name and the command line before each command.
        on_end: Called after each claim.

    Raises:
        BadInput: The folder holds figures of other code or of another scale.
        KeyboardInterrupt: Ctrl-C; the running command has ended, and the same call continues.
    """
    lines = {name: claim.lines(scale) for name, claim in claims.items()}
    identity = {"campaign": "bench all", MANIFEST_SCALE: scale, **described_code()}
    open_folder(out, identity, keep=True)
    outcomes = []
    for name, claim in claims.items():
        kept = finished(out, name)
        if kept is not None:
            if kept["commands"] != list(lines[name]):
                raise BadInput(f"{out / name}: was made by other commands ({'; '.join(kept['commands'])}); remove it")
            outcomes.append(ClaimEnd(name, before=True))
        else:
            began = perf_counter()
            failed = _measure(_Task(name, out, more or {}, tuple(words), on_start), claim, lines[name])
            outcomes.append(ClaimEnd(name, perf_counter() - began, failed))
        on_end(outcomes[-1])
    return outcomes


def finished(out: Path, name: str) -> dict[str, Any] | None:
    """Return the done.json of a claim that is measured, or None."""
    path = out / name / DONE
    if not path.is_file():
        return None
    found = read_json(path)
    if not isinstance(found, dict) or not isinstance(found.get("commands"), list):
        raise BadInput(f"{path}: cannot be read; remove {path.parent} to measure it again")
    return found


@dataclass(frozen=True)
class _Task:
    """Settings that the commands of one claim share."""

    name: str
    out: Path
    more: Mapping[str, Collection[str]]
    words: tuple[str, ...]
    on_start: Callable[[str, str], object]

    @property
    def folder(self) -> Path:
        return (self.out / self.name).absolute()

    def taken_by(self, line: str) -> Collection[str]:
        """Return the options of a bench; none for any other command."""
        _, words = _split(line)
        return self.more.get(words[2], ("--out",)) if words[:2] == ["glotouch", "bench"] else ()


def _measure(task: _Task, claim: Claim, lines: Sequence[str]) -> str | None:
    """Run all parts of a claim, then write its summary and done.json; return what went wrong."""
    began, codes = perf_counter(), []
    try:
        for part, text in (claim.parts or {"": ""}).items():
            folder = task.folder / part
            objects = task.folder.with_name(f"{task.name}.objects") / part
            if folder.is_dir() and "--resume" not in task.taken_by(lines[-1]):
                shutil.rmtree(folder)  # what cannot be continued begins anew
            folder.mkdir(parents=True, exist_ok=True)
            for line in lines:
                filled = line.format(out=shlex.quote(str(folder)), objects=shlex.quote(str(objects)), part=text)
                codes.append(_run(task, filled, folder))
            if not (folder / SUMMARY).is_file():
                _printed_summary(folder)
        if claim.parts:
            summaries = {part: read_json(task.folder / part / SUMMARY) for part in claim.parts}
            RunFolder(task.folder).write_text(SUMMARY, json.dumps(summaries, indent=1) + "\n")
        wall_s = round(perf_counter() - began, 1)
        end = {"commands": list(lines), "commit": commit_of_source(), "exit_codes": codes, "wall_s": wall_s}
        RunFolder(task.folder).write_text(DONE, json.dumps(end, indent=1) + "\n")
    except GlotouchError as e:
        return str(e)
    return None


def _run(task: _Task, line: str, folder: Path) -> int:
    """Run one command line; return its exit code.

    Raises:
        GlotouchError: It has no result.
    """
    variables, words = _split(line)
    takes = task.taken_by(line)
    if takes:
        words += ["--out", str(folder), *(["--resume"] if "--resume" in takes else [])]
        given = zip(task.words[::2], task.words[1::2], strict=True)
        words += [w for option, value in given if option in takes for w in (option, value)]
    task.on_start(task.name, shlex.join(words))
    environment = {"OMP_NUM_THREADS": "1"} | os.environ | variables
    with (folder / OUTPUT).open("w", encoding="utf-8") as output:
        code = _wait(subprocess.Popen(_argv(words), stdout=output, env=environment, process_group=0))
    if code not in RESULTS:
        raise GlotouchError(f"exit code {code}: {line}")
    return code


def _split(line: str) -> tuple[dict[str, str], list[str]]:
    """Return the NAME=VALUE words before a command, and its words."""
    words = shlex.split(line)
    variables: dict[str, str] = {}
    while words and "=" in words[0] and words[0].partition("=")[0].isidentifier():
        name, _, value = words.pop(0).partition("=")
        variables[name] = value
    if not words:
        raise GlotouchError(f"{line}: is no command")
    return variables, words


def _argv(words: list[str]) -> list[str]:
    """Return the words with our interpreter as `python` and `glotouch`.

    Raises:
        GlotouchError: The command needs a file of the repository, which an installed package does not have.
    """
    if words[0] == "glotouch":
        return [sys.executable, "-m", "glotouch_bt.cli", *words[1:]]
    if words[0] != "python":
        return words
    if words[1].endswith(".py"):
        script = ROOT / words[1]
        if not script.is_file():
            raise GlotouchError(
                f"{words[1]}: is not installed; run `glotouch bench all` from a clone of the repository"
            )
        return [sys.executable, str(script), *words[2:]]
    return [sys.executable, *words[1:]]


def _wait(process: subprocess.Popen[bytes]) -> int:
    """Wait for a process. Ctrl-C is passed on, so that it ends its trials safely; a second one hurries it."""
    try:
        return process.wait()
    except KeyboardInterrupt:
        while process.poll() is None:
            with suppress(OSError):
                process.send_signal(signal.SIGINT)
            try:
                process.wait()
            except KeyboardInterrupt:
                continue
        raise


def _printed_summary(folder: Path) -> None:
    """Keep the JSON that the last command printed as the summary.

    Raises:
        GlotouchError: It printed none.
    """
    text = (folder / OUTPUT).read_text(encoding="utf-8")
    start = text.find("{")
    try:
        json.loads(text[start:] if start >= 0 else "")
    except ValueError as e:
        raise GlotouchError(f"{folder}: the command left no {SUMMARY} and printed no JSON ({folder / OUTPUT})") from e
    RunFolder(folder).write_text(SUMMARY, text[start:])
