"""Run docs/tutorial.md as written: its files in an empty folder, its commands in order, their output compared."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import venv
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r'^```(?P<language>\w+)(?: title="(?P<file>[^"]+)")?\n(?P<body>.*?)^```$', re.MULTILINE | re.DOTALL)
COMMANDS = {"pip": "pip", "pytest": "pytest", "glotouch": "glotouch_bt.cli"}
MAX_DURATION_S = 120.0


@dataclass(frozen=True)
class Step:
    """A file to write, or a command with the output it shall have."""

    file: str
    body: str
    expected: str = ""


def steps(text: str) -> list[Step]:
    found: list[Step] = []
    for block in BLOCK.finditer(text):
        if block["file"]:
            found.append(Step(block["file"], block["body"]))
        elif block["language"] == "console":
            for part in re.split(r"^\$ ", block["body"], flags=re.MULTILINE)[1:]:
                command, _, expected = part.partition("\n")
                found.append(Step("", command, expected))
    return found


def fits(expected: str, found: str) -> bool:
    """`...` stands for anything, lines too; spaces at the ends of lines do not count."""
    wanted, had = ("\n".join(line.rstrip() for line in text.strip().splitlines()) for text in (expected, found))
    return re.fullmatch(".*".join(map(re.escape, wanted.split("..."))), had, re.DOTALL) is not None


def own_environment(folder: Path) -> dict[str, str]:
    """An environment that sees what is installed here, and where the reader's package leaves its traces."""
    venv.create(folder, with_pip=False)
    bin_ = folder / "bin"
    site = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    here = sysconfig.get_path("purelib")
    (site / "here.pth").write_text(f"import site; site.addsitedir({here!r})\n")
    for name, module in COMMANDS.items():
        (bin_ / name).write_text(f'#!/bin/sh\nexec "{bin_ / "python"}" -m {module} "$@"\n')
        (bin_ / name).chmod(0o755)
    keep = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTEST_ADDOPTS", "PYTEST_CURRENT_TEST")}
    return keep | {"PATH": f"{bin_}{os.pathsep}{keep['PATH']}", "COLUMNS": "120", "NO_COLOR": "1", "MPLBACKEND": "Agg"}


def test_the_page_is_true(tmp_path: Path) -> None:
    environment = own_environment(tmp_path / "venv")
    reader = tmp_path / "bell"
    reader.mkdir()
    for step in steps((ROOT / "docs/tutorial.md").read_text()):
        if step.file:
            (reader / step.file).parent.mkdir(parents=True, exist_ok=True)
            (reader / step.file).write_text(step.body)
            continue
        done = subprocess.run(
            ["/bin/sh", "-c", step.body],
            cwd=reader,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=MAX_DURATION_S,
            check=False,
        )
        said = f"$ {step.body}\n{done.stdout}"
        assert "Traceback" not in done.stdout, said
        assert done.returncode == 0, said
        assert fits(step.expected, done.stdout), f"{said}\n--- expected:\n{step.expected}"


@pytest.mark.parametrize(
    ("expected", "found", "same"),
    [
        ("a\n", "a  \n", True),
        ("a...c", "a b\nb c", True),
        ("a", "ab", False),
        ("...b", "a b", True),
        ("a.c", "abc", False),
    ],
)
def test_what_counts_as_the_same_output(expected: str, found: str, same: bool) -> None:
    assert fits(expected, found) is same


def test_the_mission_without_code_is_the_example() -> None:
    (shown,) = [step.body for step in steps((ROOT / "docs/tutorial.md").read_text()) if step.file == "crowded.yaml"]
    assert shown == (ROOT / "examples/crowded.yaml").read_text()


def test_the_page_has_files_and_commands() -> None:
    found = steps((ROOT / "docs/tutorial.md").read_text())
    assert sum(bool(s.file) for s in found) >= 6
    assert sum(not s.file for s in found) >= 9
    assert sys.version_info >= (3, 11)
