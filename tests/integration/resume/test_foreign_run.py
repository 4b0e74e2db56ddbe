"""A run's folder from a stranger is data: no command runs, reads or writes anything else because of it."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE
from glotouch_bt.mission.checkpoint.codec import encode
from tests.support import fake_cli

MISSION = """mission: m
world: container_five
tree:
  sequence:
    - wait: {name: first, seconds: 0.5}
    - wait: {name: second, seconds: 0.5, end: stop}
"""
Glotouch = Callable[..., Any]


@pytest.fixture(scope="module")
def fakes() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        fake_cli.install_fakes(patch.setattr)
        yield fake_cli


def glotouch(*words: object) -> Any:
    done = CliRunner().invoke(cli.app, [str(w) for w in words])
    assert "internal error" not in done.stderr
    assert "Traceback" not in done.stderr
    return SimpleNamespace(code=done.exit_code, out=done.stdout, err=done.stderr)


@pytest.fixture(scope="module")
def base(fakes: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that a safety stop ended."""
    folder = tmp_path_factory.mktemp("base")
    (folder / "m.yaml").write_text(MISSION)
    assert glotouch("run", folder / "m.yaml", "--seed", 4, "--out", folder / "run").code == 3
    return folder / "run"


@pytest.fixture
def run(base: Path, tmp_path: Path) -> Path:
    shutil.copytree(base, tmp_path / "run")
    return tmp_path / "run"


def query(run: Path, text: str, *values: object) -> None:
    db = sqlite3.connect(run / CHECKPOINT_FILE)
    with db:
        db.execute(text, values)
    db.close()


def describe(run: Path, **request: object) -> None:
    """Change the run's request."""
    db = sqlite3.connect(run / CHECKPOINT_FILE)
    with db:
        (text,) = db.execute("SELECT value FROM run WHERE key = 'request'").fetchone()
        db.execute("UPDATE run SET value = ? WHERE key = 'request'", (json.dumps(json.loads(text) | request),))
    db.close()


def refused(*words: object) -> str:
    done = glotouch(*words)
    assert done.code == 2, done.err
    (words,) = [line for line in done.err.splitlines() if line.startswith("glotouch: ")]
    return str(words)


def left_alone(run: Path, base: Path) -> bool:
    names = ("result.json", "run.mcap", "mission.yaml", "report.html")
    return not (run / "earlier").exists() and all((run / n).read_bytes() == (base / n).read_bytes() for n in names)


# -- what a request asks for -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["python", "log", "driver", "keys", "devices", "robot"])
def test_a_folder_chooses_no_program_file_address_or_device(run: Path, base: Path, tmp_path: Path, name: str) -> None:
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\ntouch {tmp_path / 'canary'}\n")
    program.chmod(0o755)
    describe(run, settings={name: str(program)})
    assert f"--set {name}=..." in refused("resume", run)
    assert left_alone(run, base)
    said = refused("resume", run, "--set", f"{name}=mine")
    assert f"unknown option '{name}'" in said, "that of the command line counts"
    assert left_alone(run, base)
    assert glotouch("resume", run, "--set", f"{name}=").code == 3, "left out: the safety stop again"
    assert sorted(os.listdir(tmp_path)) == ["program", "run"]


def test_a_path_to_objects_is_given_again(run: Path, base: Path, tmp_path: Path) -> None:
    describe(run, objects="/somewhere")
    assert "--objects DIR" in refused("resume", run)
    assert left_alone(run, base)
    assert "is not a folder with .stl files" in refused("resume", run, "--objects", tmp_path)


def test_no_path_of_a_request_is_opened(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mission comes from the folder, the conditions from the checkpoint."""
    opened: list[str] = []
    sys.addaudithook(lambda event, args: opened.append(str(args[0])) if event == "open" and args[0] else None)
    describe(run, mission="/etc/shadow.yaml", conditions="/etc/shadow.yaml")
    assert glotouch("resume", run).code == 3
    assert not [p for p in opened if "shadow" in p]


def test_a_parameter_of_the_mission_stays_as_it_was(base: Path, run: Path) -> None:
    query(run, "UPDATE run SET value = replace(value, 'first', 'other') WHERE key = 'mission'")
    assert "cannot be loaded again" in refused("resume", run)


# -- crafted checkpoints -----------------------------------------------------------------------------------------------

VIEW = "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x FROM c"
TABLES: dict[str, list[str]] = {
    "a recursive view": [VIEW],
    "a view in place of a table": [
        "DROP TABLE checkpoint",
        "CREATE VIEW checkpoint AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) "
        "SELECT x AS number, 0.0 AS stamp_s, '' AS node, '' AS status, '[]' AS begun, '{}' AS lacking, "
        "0 AS record_bytes, x'00' AS state, NULL AS world FROM c",
    ],
    "a trigger": ["CREATE TRIGGER t AFTER INSERT ON run BEGIN DELETE FROM checkpoint; END"],
    "another column": ["ALTER TABLE checkpoint ADD COLUMN more"],
    "no table": ["DROP TABLE run"],
    "infinite time": ["UPDATE checkpoint SET stamp_s = 9e999"],
    "time in words": ["UPDATE checkpoint SET stamp_s = 'soon'"],
    "bytes for words": ["UPDATE checkpoint SET node = x'ff00'"],
    "begun is no list": ["UPDATE checkpoint SET begun = '{}'"],
    "lacking is no mapping": ["UPDATE checkpoint SET lacking = '[1]'"],
    "a negative record": ["UPDATE checkpoint SET record_bytes = -5"],
    "no JSON": ["UPDATE run SET value = '{'"],
    "deep JSON": ["UPDATE run SET value = replace(hex(zeroblob(50000)), '00', '[')"],
}


@pytest.mark.parametrize("what", TABLES)
def test_damaged_tables_are_bad_input_everywhere(run: Path, base: Path, what: str) -> None:
    for text in TABLES[what]:
        query(run, text)
    assert CHECKPOINT_FILE in refused("resume", run, "--list")
    refused("resume", run, "--list", "--json")
    assert CHECKPOINT_FILE in refused("resume", run)
    assert left_alone(run, base)


def test_a_journal_deletes_nothing(run: Path, tmp_path: Path) -> None:
    """SQLite deletes the file that a rollback journal names as its super-journal."""
    (run / f"{CHECKPOINT_FILE}-journal").write_bytes(b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7" + bytes(600))
    assert "no such file" in refused("resume", run, "--list")


Values = dict[str, Any]
STATES: dict[str, Callable[[Values], Any]] = {
    "a bomb": lambda s: None,
    "no mapping": lambda s: [1, 2],
    "keys that are no words": lambda s: {1: 2},
    "no tree": lambda s: {k: v for k, v in s.items() if k != "tree"},
    "a tree of words": lambda s: s | {"tree": "oak"},
    "nodes of numbers": lambda s: s | {"tree": {"nodes": 5, "finished": ()}},
    "a finished node that is none": lambda s: s | {"tree": s["tree"] | {"finished": ("nowhere",)}},
    "a status that is none": lambda s: s | {"status": dict.fromkeys(s["status"], "DONE")},
    "NaN time": lambda s: s | {"elapsed": (float("nan"), 0.0)},
    "infinite pause": lambda s: s | {"paused_s": float("inf")},
    "ticks in words": lambda s: s | {"ticks": "many"},
    "a summary of words": lambda s: s | {"summary": s["summary"] | {"contacts": "many"}},
    "the port of a class that is none": lambda s: s | {"port x": b"raw"},
}


@pytest.mark.parametrize("what", STATES)
def test_damaged_state_is_bad_input_and_changes_nothing(run: Path, base: Path, what: str) -> None:
    from glotouch_bt.mission.checkpoint import CheckpointFile

    file = CheckpointFile(run / CHECKPOINT_FILE)
    state = file.state(1)
    file.close()
    made = STATES[what](state)
    packed = zstandard.compress(encode(made))
    if what == "a bomb":
        packed = zstandard.compress(bytes(300_000_000))
        assert len(packed) < 100_000
    if what == "the port of a class that is none":
        plain = msgspec.msgpack.decode(encode({}))
        plain += [["port x", ["d", "os:system", ["a", 1]]]]
        packed = zstandard.compress(msgspec.msgpack.encode(plain))
    query(run, "UPDATE checkpoint SET state = ? WHERE number = 1", packed)
    words = refused("resume", run)
    assert "checkpoint" in words
    assert left_alone(run, base)


def test_a_shared_value_counts_each_time(run: Path) -> None:
    """A billion laughs: nested references, as small as one line."""
    laughs = ["t", ["l", 1], *(["t", *[["r", n + 1]] * 10] for n in range(12))]
    packed = zstandard.compress(msgspec.msgpack.encode(["m", ["port a", laughs]]))
    query(run, "UPDATE checkpoint SET state = ?", packed)
    assert "values" in refused("resume", run)


# -- links and replaced files ------------------------------------------------------------------------------------------


NAMES = (".report.html.part", ".run.mcap.part", ".result.json.part", "report.html", "run.mcap", "mission.yaml",
         "result.json", CHECKPOINT_FILE, f"{CHECKPOINT_FILE}-wal", "earlier")  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", ["resume", "report", "replay", "resume --list"])
def test_nothing_outside_is_touched_through_a_link(run: Path, tmp_path: Path, name: str, command: str) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    victim = outside / "victim"
    victim.write_text("precious")
    (run / name).unlink(missing_ok=True)
    (run / name).symlink_to(outside if name == "earlier" else victim)
    word, *options = command.split()
    done = glotouch(word, run, *options)
    assert done.code in (0, 1, 2, 3)
    assert victim.read_text() == "precious"
    assert os.listdir(outside) == ["victim"]
    if command == "resume":
        assert done.code == 2
        assert "symbolic link" in done.err


# -- a kill between two steps of a resumption --------------------------------------------------------------------------


@pytest.mark.parametrize("step", ["_link", "begin_again"])
def test_a_resumption_killed_between_two_steps_can_be_resumed(run: Path, step: str) -> None:
    """With --from, the run had ended before: it has not, as soon as its result is gone."""
    query(run, "UPDATE run SET value = '\"failure\"' WHERE key = 'ended'")
    where = {"_link": "glotouch_bt.runs.resume_point._link"}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(where.get(step, f"glotouch_bt.mission.checkpoint.store.CheckpointFile.{step}"), _killed)
        with pytest.raises(SystemExit):
            _invoke("resume", run, "--from", "first")
    ended = json.loads(glotouch("resume", run, "--list", "--json").out)["ended"]
    assert (run / "result.json").exists() or ended is None
    assert glotouch("resume", run, *(() if ended is None else ("--from", "first"))).code == 3
    assert (run / "result.json").exists()


def _killed(*args: object) -> None:
    raise SystemExit(137)


def _invoke(*words: object) -> None:
    done = CliRunner().invoke(cli.app, [str(w) for w in words])
    raise SystemExit(done.exit_code)


def test_arrays_of_odd_shapes_are_refused() -> None:
    from glotouch_bt.mission.checkpoint import decode
    from glotouch_bt.robot import BadInput

    good = np.arange(3.0)
    assert np.array_equal(decode(encode(good)), good)
    for shape in ([2**40], [-1], [0, 2**62], [1] * 40, ["3"], [3.0]):
        with pytest.raises(BadInput):
            decode(msgspec.msgpack.encode(["a", "<f8", shape, "C", True, good.tobytes()]))
