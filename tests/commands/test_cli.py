"""The command line: help, exit codes, one message for an error, JSON, and no files after bad input."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from glotouch_bt import __version__, cli
from glotouch_bt.commands import COMMANDS
from glotouch_bt.mission.read import library
from glotouch_bt.mission.read.library import shipped
from glotouch_bt.robot import BadInput
from glotouch_bt.runs.folder import locked
from tests.support import fake_cli


@pytest.fixture
def command() -> Iterator[CliRunner]:
    yield CliRunner()
    cli._debug = False


def test_help_groups_the_commands_by_use(command: CliRunner) -> None:
    done = command.invoke(cli.app, ["--help"])
    assert done.exit_code == 0
    assert [use for use in re.findall(r"^(\S.*):$", done.output, re.MULTILINE) if use != "Options"] == [
        "Run missions", "Write missions", "Objects, robots and faults", "Measure"
    ]  # fmt: skip
    listed = re.findall(r"^  (\w+)  ", done.output, re.MULTILINE)
    assert listed[0] == "run"
    assert set(listed) == {name for commands in COMMANDS.values() for name in commands} | {"bench"}
    assert "..." not in done.output.split("Run missions")[1], "each line shows its whole sentence"


def test_version(command: CliRunner) -> None:
    assert command.invoke(cli.app, ["--version"]).output == f"glotouch {__version__}\n"


def test_completion_of_commands() -> None:
    code = "import sys; sys.argv = ['glotouch']; from glotouch_bt.cli import main; main()"
    words = {"_GLOTOUCH_COMPLETE": "complete_bash", "COMP_WORDS": "glotouch rep", "COMP_CWORD": "1"}
    done = subprocess.run([sys.executable, "-c", code], env={**os.environ, **words}, capture_output=True, text=True)
    assert done.stdout.split() == ["replay", "report"]


def test_other_systems_get_a_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with pytest.raises(BadInput, match="runs need Linux or macOS"), locked(tmp_path):
        pass
    monkeypatch.setattr(cli, "os", SimpleNamespace(name="nt"))
    with pytest.raises(SystemExit, match="use Linux or macOS, or WSL 2 or Docker on Windows"):
        cli.main()


def test_help_imports_nothing_heavy() -> None:
    heavy = "('numpy', 'py_trees', 'mujoco', 'pydantic')"
    code = f"import sys, glotouch_bt.cli; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


BAD = [
    (["run", "nothing"], "unknown mission 'nothing'"),
    (["run", "gone/m.yaml"], "no such mission file"),
    (["run", "retrieve", "--set", "target"], "must be NAME=VALUE"),
    (["run", "retrieve", "--set", "target=wukog"], "did you mean 'wukong'"),
    (["run", "survey", "--set", "expected_objects=0"], "must be in [1, 20]"),
    (["run", "retrieve", "--set", "target=apple", "--set", "target=train"], "given twice"),
    (["run", "survey", "--backend", "mujco"], "unknown backend 'mujco'"),
    (["run", "survey", "--conditions", "nominl"], "did you mean 'nominal'"),
    (["run", "survey", "--conditions", "nominal+gel_blur_mm=1.5"], "did you mean 'gel_blur_m'"),
    (["run", "survey", "--set-condition", "gel_blr_m=0.001"], "did you mean 'gel_blur_m'"),
    (["run", "survey", "--set-condition", "gel_blur_m"], "--set-condition gel_blur_m: must be NAME=VALUE"),
    (["run", "survey", "--seed", "-1"], "--seed -1"),
    (["run", "survey", "--objects", "gone"], "--objects gone"),
    (["check", "nothing"], "unknown mission"),
    (["skills", "squeez"], "did you mean 'squeeze'"),
    (["tree", "nothing"], "unknown mission"),
    (["report", "gone"], "no run here; give the folder that `glotouch run` printed"),
    (["resume", "gone"], "no run here"),
    (["missions", "explore"], "is a shipped subtree, not a mission"),
    (["missions", "close_five"], "is a shipped world, not a mission"),
    (["faults", "dropped_probe"], "run it with --faults dropped_probe"),
    (["run", "retrieve", "--world", "clutter_ten"], "--set target=NAME"),
    (["run"], "MISSION"),
    (["run", "retrieve", "--nonsense"], "No such option"),
]


@pytest.mark.parametrize(("words", "message"), BAD, ids=[" ".join(w) for w, _ in BAD])
def test_bad_input_is_exit_2_with_one_message(
    words: list[str], message: str, command: CliRunner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = command.invoke(cli.app, words)
    assert done.exit_code == 2, done.output
    assert message in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.output
    assert list(tmp_path.iterdir()) == [], "nothing is left behind"


def test_an_unwritable_out_moves_nothing(command: CliRunner, tmp_path: Path) -> None:
    taken = tmp_path / "file"
    taken.write_text("x")
    done = command.invoke(cli.app, ["run", "survey", "--out", str(taken / "run")])
    assert done.exit_code == 2
    assert "cannot be written here" in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("name", sorted(library.shipped("")))
def test_shipped_missions_have_no_fault(name: str, command: CliRunner) -> None:
    done = command.invoke(cli.app, ["check", name])
    assert done.exit_code == 0, done.stderr
    assert f"{name}: ok" in done.stdout


def test_check_reports_every_file(command: CliRunner, tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("mission: m\nworld: container_five\ntree:\n  - liift\n  - grasp: {force_N: 99}\n")
    done = command.invoke(cli.app, ["check", "survey", str(bad), "--json"])
    assert done.exit_code == 2
    data = json.loads(done.stdout)
    assert [m["ok"] for m in data["missions"]] == [True, False]
    codes = {(f["line"], f["column"], f["code"]) for f in data["missions"][1]["findings"]}
    assert {(4, 5, "unknown_skill"), (5, 22, "wrong_range")} <= codes
    text = command.invoke(cli.app, ["check", str(bad)])
    assert f"{bad}:4:5: error: unknown skill or node 'liift'; did you mean 'lift'?" in text.stderr


def test_tree_draws_text_and_svg(command: CliRunner, tmp_path: Path) -> None:
    text = command.invoke(cli.app, ["tree", "retrieve"])
    assert text.exit_code == 0
    for name in ("tool_pickup", "guarded_sweep", "orbit_probe", "touch_next", "match", "grasp", "lift"):
        assert name in text.stdout
    import xml.etree.ElementTree as ET

    out = tmp_path / "tree.svg"
    assert command.invoke(cli.app, ["tree", "survey", "--format", "svg", "--out", str(out)]).exit_code == 0
    assert ET.parse(out).getroot().tag.endswith("svg")


def test_skills_and_backends_as_json(command: CliRunner) -> None:
    skills = json.loads(command.invoke(cli.app, ["skills", "--json"]).stdout)
    squeeze = next(s for s in skills if s["name"] == "squeeze")
    assert {"name": "force_N", "unit": "N"}.items() <= next(
        p for p in squeeze["parameters"] if p["name"] == "force_N"
    ).items()
    assert [p["name"] for p in squeeze["outputs"]] == ["touchset"]
    backends = json.loads(command.invoke(cli.app, ["backends", "--json"]).stdout)
    assert "mujoco" in [b["name"] for b in backends]


def test_missions_and_nodes(command: CliRunner) -> None:
    missions = {m["name"]: m for m in json.loads(command.invoke(cli.app, ["missions", "--json"]).stdout)}
    assert set(missions) == set(shipped(""))
    (target, *_) = missions["retrieve"]["parameters"]
    assert (target["name"], target["type"], target["default"]) == ("target", "stl", "wukong")
    nodes = {n["name"]: n for n in json.loads(command.invoke(cli.app, ["nodes", "--json"]).stdout)}
    assert [s["name"] for s in nodes["retry"]["settings"]] == ["attempts"]
    assert "attempts" in command.invoke(cli.app, ["nodes", "retry"]).stdout
    listed = command.invoke(cli.app, ["missions"]).stdout
    assert "conditions: harsh, ideal, nominal" in listed
    assert "explore, find_objects" in listed
    assert "expected_objects" in command.invoke(cli.app, ["missions", "retrieve"]).stdout
    for words in (["missions", "retriev"], ["nodes", "rety"]):
        assert "did you mean" in command.invoke(cli.app, words).stderr


def test_schema_accepts_the_shipped_missions(command: CliRunner) -> None:
    """The schema names every node and skill; its own structure is sound (references resolve)."""
    schema = json.loads(command.invoke(cli.app, ["schema"]).stdout)
    named = schema["$defs"]["node"]["anyOf"][2]["properties"]
    assert {"sequence", "for_each", "squeeze", "lift"} <= set(named)

    def references(value: Any) -> Iterator[str]:
        if isinstance(value, dict):
            if isinstance(value.get("$ref"), str):
                yield value["$ref"]
            for v in value.values():
                yield from references(v)
        elif isinstance(value, list):
            for v in value:
                yield from references(v)

    for reference in references(schema):
        assert reference.removeprefix("#/$defs/") in schema["$defs"]
    for name, path in shipped("").items():
        assert _fits(yaml.safe_load(path.read_text()), schema, schema), name
    head = {"mission": "m", "world": "container_five"}
    for tree, fits in (
        ({"condition": {"port": "grip_m", "at_least": "40 mm"}}, True),
        ({"condition": {"port": "grip_m", "at_least": "40 apples"}}, False),
        ({"repeat": {"until": {"port": "found", "at_least": "$n"}, "do": "orbit_probe"}}, True),
        ({"lift": {"in": {"grip_m": 0.04}}}, True),
        ({"lift": {"in": {"grap_m": 0.04}}}, False),
        ({"lift": {"out": {"weight_N": 3}}}, False),
        ("graps", False),
    ):
        assert _fits({**head, "tree": tree}, schema, schema) == fits, tree


def _fits(value: Any, schema: dict[str, Any], root: dict[str, Any]) -> bool:
    """As much of a JSON Schema validator as this schema needs."""
    if "$ref" in schema:
        return _fits(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], root)
    kinds = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "boolean": bool}
    kinds["null"] = type(None)
    if "anyOf" in schema and not any(_fits(value, s, root) for s in schema["anyOf"]):
        return False
    if "type" in schema and not isinstance(value, kinds[schema["type"]]):
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if isinstance(value, str) and not re.search(schema.get("pattern", ""), value):
        return False
    if isinstance(value, list):
        return all(_fits(v, schema.get("items", {}), root) for v in value)
    if not isinstance(value, dict):
        return True
    others = schema.get("additionalProperties", {})
    known = schema.get("properties", {})
    if not set(schema.get("required", ())) <= set(value) or (others is False and not set(value) <= set(known)):
        return False
    return all(_fits(v, known.get(k, others), root) for k, v in value.items())


FAKE_CLI = Path(__file__).parents[1] / "support" / "fake_cli.py"
RUN = "mission: nap\nworld: container_five\nparameters:\n"
RUN += "  s: {type: float, default: 0.3, unit: s}\n  end: {type: str, default: ok}\n"
RUN += "tree:\n  - wait: {name: first}\n  - wait: {name: nap, seconds: $s, end: $end}\n"


@pytest.fixture
def fakes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    fake_cli.install_fakes(monkeypatch.setattr)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nap.yaml").write_text(RUN)
    return fake_cli


def test_a_run_leaves_its_folder(command: CliRunner, fakes: ModuleType, tmp_path: Path) -> None:
    done = command.invoke(cli.app, ["run", "nap.yaml", "--seed", "3"])
    assert done.exit_code == 0, done.stderr
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.endswith("-nap-s3")
    files = {"mission.yaml", "run.mcap", "checkpoint.sqlite", "result.json", "report.html"}
    assert {p.name for p in folder.iterdir()} == files
    assert "report: " in done.stdout
    result = json.loads((folder / "result.json").read_text())
    assert (result["mission"], result["seed"], result["status"], result["reasons"]) == ("nap", 3, "success", [])
    assert result["sim_time_s"] == pytest.approx(0.4)


def test_the_same_command_twice_gives_the_same_result(command: CliRunner, fakes: ModuleType, tmp_path: Path) -> None:
    results, records = [], []
    for _ in range(2):
        assert command.invoke(cli.app, ["run", "nap.yaml", "--out", "same", "--overwrite"]).exit_code == 0
        result = json.loads((tmp_path / "same" / "result.json").read_text())
        results.append({k: v for k, v in result.items() if not k.startswith("wall_")})
        records.append((tmp_path / "same" / "run.mcap").read_bytes())
    assert results[0] == results[1]
    assert records[0] == records[1]
    assert str(tmp_path) not in json.dumps(results[0])


@pytest.mark.parametrize(
    ("end", "code", "status", "message"),
    [
        ("fail", 1, "failure", "told_to: the script says so (say ok)"),
        ("stop", 3, "aborted", "safety stop"),
        ("bug", 3, "aborted", "ZeroDivisionError: a bug"),
    ],
)
def test_exit_codes_of_runs(
    end: str, code: int, status: str, message: str, command: CliRunner, fakes: ModuleType, tmp_path: Path
) -> None:
    done = command.invoke(cli.app, ["run", "nap.yaml", "--set", f"end={end}", "--out", "o", "--json"])
    assert done.exit_code == code, done.output
    result = json.loads(done.stdout)
    assert result["status"] == status
    assert message in result["reasons"][-1]
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert json.loads((tmp_path / "o" / "result.json").read_text())["status"] == status


def test_what_no_parameter_takes_goes_to_the_backend(command: CliRunner, fakes: ModuleType, tmp_path: Path) -> None:
    done = command.invoke(cli.app, ["run", "nap.yaml", "--set", "sleep=2"])
    assert done.exit_code == 2
    said = "--set sleep: mission 'nap' has no such parameter (valid: s, end); unknown option 'sleep' (valid: cable)"
    assert said in done.stderr
    done = command.invoke(cli.app, ["run", "nap.yaml", "--set", "cable=out"])
    assert (done.exit_code, "the cable is out" in done.stderr) == (3, True)
    assert not (tmp_path / "runs").exists()


def test_an_earlier_run_is_replaced_only_with_overwrite(command: CliRunner, fakes: ModuleType, tmp_path: Path) -> None:
    assert command.invoke(cli.app, ["run", "nap.yaml", "--out", "o"]).exit_code == 0
    kept = {p.name: p.read_bytes() for p in (tmp_path / "o").iterdir()}
    done = command.invoke(cli.app, ["run", "nap.yaml", "--out", "o"])
    assert done.exit_code == 2
    assert "o: holds an earlier run; give another folder, or --overwrite to replace it" in done.stderr
    assert {p.name: p.read_bytes() for p in (tmp_path / "o").iterdir()} == kept
    assert command.invoke(cli.app, ["run", "nap.yaml", "--seed", "1", "--out", "o", "--overwrite"]).exit_code == 0
    assert json.loads((tmp_path / "o" / "result.json").read_text())["seed"] == 1


def test_a_folder_with_other_files_is_refused(command: CliRunner, fakes: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.png").write_bytes(b"cat")
    for words in ([], ["--overwrite"]):
        done = command.invoke(cli.app, ["run", "nap.yaml", "--out", "photos", *words])
        assert done.exit_code == 2
        assert "photos: is not empty and holds no run" in done.stderr
    assert [p.name for p in (tmp_path / "photos").iterdir()] == ["cat.png"]


def test_ctrl_c_closes_the_record_and_exits_130(fakes: ModuleType, tmp_path: Path) -> None:
    """A real process, a real signal."""
    words = [sys.executable, str(FAKE_CLI), "run", "nap.yaml", "--set", "s=100000", "--out", "o"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        for _ in range(600):
            if (tmp_path / "o" / "run.mcap").exists() and (tmp_path / "o" / "run.mcap").stat().st_size > 20_000:
                break
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert "stopped by the operator" in stderr
    assert "Traceback" not in stderr
    assert json.loads((tmp_path / "o" / "result.json").read_text())["status"] == "aborted"
    from glotouch_bt.report import read_run

    record = read_run(tmp_path / "o")
    assert record.complete
    assert record.result["status"] == "aborted"


def _of_fake_run(out: Path, redirected: str) -> int:
    words = f"run calibrate --backend fake --out {out}"
    code = f"import sys; sys.argv = ['glotouch', *{words.split()!r}]; from glotouch_bt.cli import main; main()"
    shell = f'"{sys.executable}" -c "{code}" {redirected}; echo $? > "{out}.code"'
    subprocess.run(["bash", "-c", shell], check=False, capture_output=True, timeout=120)
    return int(Path(f"{out}.code").read_text())


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose output is read."""
    run = tmp_path_factory.mktemp("plain") / "run"
    assert _of_fake_run(run, "") == 1
    return run


@pytest.mark.parametrize("redirected", ["> >(true) 2> >(true)", "2> /dev/full", "<&- >&- 2>&-"])
def test_a_reader_that_has_gone_takes_no_mission_with_it(tmp_path: Path, redirected: str, plain: Path) -> None:
    cut = tmp_path / "cut"
    assert _of_fake_run(cut, redirected) == 1
    results = [json.loads((run / "result.json").read_text()) for run in (plain, cut)]
    assert results[0]["reasons"] == results[1]["reasons"] != []


def test_a_result_that_stdout_cannot_take_is_no_success() -> None:
    code = "import sys; sys.argv = ['glotouch', 'faults', '--json']; from glotouch_bt.cli import main; main()"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([sys.executable, "-c", code], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 3
    assert done.stderr == "glotouch: stdout could not be written (No space left on device)\n"


def test_a_terminal_of_few_letters_is_written_to(tmp_path: Path) -> None:
    code = "import sys; sys.argv = ['glotouch', 'tree', 'calibrate']; from glotouch_bt.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONIOENCODING": "ascii"}, capture_output=True, timeout=60
    )
    assert done.returncode == 0
    assert b"tool_pickup" in done.stdout
