"""Rules of the project that a test can check: layers, docstrings, banned calls, the contents of a wheel."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends", "glotouch_missions")
MAX_LINES = 400


def sources(*folders: str) -> list[Path]:
    return [p for folder in folders for p in sorted((ROOT / folder).rglob("*.py"))]


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def committed() -> list[Path]:
    """Return every file of the repository; skip where there is none."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a git checkout")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    return [ROOT / name for name in listed.decode().split("\0") if name and (ROOT / name).is_file()]


def shown(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_imports_run_downward() -> None:
    tool = Path(sys.executable).with_name("lint-imports")
    if not tool.exists():
        pytest.skip("import-linter is not installed")
    done = subprocess.run([tool, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def undescribed(tree: ast.Module) -> Iterator[str]:
    """Yield public functions, classes and methods without a docstring, except overrides."""
    if ast.get_docstring(tree) is None and tree.body:
        yield "the module"
    stack: list[tuple[str, ast.AST]] = [("", tree)]
    while stack:
        above, node = stack.pop()
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                continue
            if child.name.startswith("_"):
                continue
            overload = any("overload" in ast.unparse(d) or "override" in ast.unparse(d) for d in child.decorator_list)
            if ast.get_docstring(child) is None and not overload:
                yield f"{above}{child.name} (line {child.lineno})"
            if isinstance(child, ast.ClassDef):
                stack.append((f"{above}{child.name}.", child))


def test_everything_public_is_described() -> None:
    found = {shown(p): missing for p in sources(*PACKAGES) if (missing := list(undescribed(parsed(p))))}
    assert found == {}


def test_files_stay_short() -> None:
    long = {shown(p): n for p in sources(*PACKAGES, "tests") if (n := len(p.read_text().splitlines())) > MAX_LINES}
    assert long == {}, "split them"


@pytest.mark.parametrize(
    ("what", "pattern", "folders"),
    [
        ("wall time (time is the robot's clock)", r"\btime\.time\(", PACKAGES),
        ("sleeping, but for the driver's one clock", r"\btime\.sleep\((?!left\))", PACKAGES),
        ("uninitialised memory", r"\bnp\.empty(_like)?\(", PACKAGES),
        ("global random numbers", r"\bnp\.random\.(seed|rand|randn|normal|uniform)\b|^import random$", PACKAGES),
        ("a backend's name", r"(?i)mujoco|flexiv|xense|\brizon", ("glotouch_skills",)),
    ],
)
def test_banned(what: str, pattern: str, folders: tuple[str, ...]) -> None:
    found = []
    for path in sources(*folders):
        code = "\n".join(line for line in path.read_text().splitlines() if "noqa" not in line)
        found += [f"{shown(path)}: {m[0]}" for m in re.finditer(pattern, code, re.MULTILINE)]
    assert found == [], what


def test_no_code_knows_an_object_by_name() -> None:
    """No string in the code is the name of a shipped object; missions are not code."""
    names = {p.stem for p in (ROOT / "glotouch_missions" / "objects").glob("*.stl")}
    assert names
    found = [
        f"{shown(path)}:{node.lineno}: {node.value!r}"
        for path in sources(*PACKAGES)
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.lower() in names
    ]
    assert found == []


REGISTRY = re.compile(
    rb"(?i)https?://[^\s)\"'>]*(pypi|pythonhosted|artifactory|nexus|mirror|/simple\b)|--(extra-)?index[-]url|--trusted-host"
    rb"|--find-links|index[-_]url *="
)
MACHINE = re.compile(
    rb"/home/[a-z]|/root/|/Users/|/work/[a-z]|\b(?:10\.\d{1,3}|192\.168|172\.16)(?:\.\d{1,3}){2}\b|\blocalhost:\d"
)


def test_no_registry_host_or_machine_path_is_committed() -> None:
    found = []
    for path in committed():
        if path == Path(__file__) or path.suffix in (".npz", ".stl", ".png", ".ico"):
            continue
        text = path.read_bytes()
        found += [
            f"{shown(path)}: {m[0].decode(errors='replace')}"
            for rule in (REGISTRY, MACHINE)
            for m in rule.finditer(text)
        ]
    assert found == []


def test_backends_and_skills_are_regular_packages() -> None:
    """A namespace package named `mujoco` would shadow `import mujoco` when its parent folder is on the path."""
    for name in ("glotouch_backends", "glotouch_backends/mujoco", "glotouch_skills", "glotouch_missions"):
        assert (ROOT / name / "__init__.py").is_file()
    assert not list((ROOT / "tests").rglob("__init__.py")), "tests are imported by path"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of the committed files."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    for path in committed():
        if path.relative_to(ROOT).parts[0] in (*PACKAGES, "pyproject.toml", "README.md", "LICENSE"):
            target = source / path.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    done = subprocess.run([*command, str(source), "-w", str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (made,) = folder.glob("*.whl")
    return made


def test_a_wheel_carries_everything(wheel: Path) -> None:
    """Missions, worlds, conditions, meshes and hulls are package data; the wheel has the module of each entry point."""
    with zipfile.ZipFile(wheel) as archive:
        inside = set(archive.namelist())
        (entry_points,) = (n for n in inside if n.endswith("entry_points.txt"))
        points = archive.read(entry_points).decode()
    expected = {
        shown(p)
        for p in committed()
        if p.relative_to(ROOT).parts[0] in PACKAGES and p.suffix in (".py", ".yaml", ".stl", ".npz")
    }
    assert expected - inside == set()
    for kind in ("worlds", "conditions", "faults", "objects", "hulls"):
        assert any(n.startswith(f"glotouch_missions/{kind}/") for n in inside), kind
    assert "glotouch_bt/py.typed" in inside
    assert not [n for n in inside if n.startswith(("tests/", "examples/"))]
    for module in re.findall(r"= *([\w.]+):", points):
        path = module.replace(".", "/")
        assert f"{path}.py" in inside or f"{path}/__init__.py" in inside, module


SCRIPT = """
import backends, missions, skills
import glotouch_bt as gt

print(gt.__file__)
print([f for f in gt.check("retrieve") if f.severity == "error"])
print(gt.run("calibrate", backend="fake").status)
"""


def test_a_user_s_own_folders_do_not_break_an_installed_wheel(wheel: Path, tmp_path: Path) -> None:
    """Packages named skills, backends and missions stand beside the user's script."""
    site, work = tmp_path / "site", tmp_path / "work"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    for name in ("skills", "backends", "missions"):
        (work / name).mkdir(parents=True)
        (work / name / "__init__.py").write_text("")
    (work / "script.py").write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": str(site), "NUMBA_DISABLE_JIT": "1"}  # compiling takes 15 s
    for words in (["script.py"], ["-m", "glotouch_bt.cli", "check", "retrieve"]):
        done = subprocess.run(
            [sys.executable, *words], cwd=work, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        if words == ["script.py"]:
            assert done.stdout.splitlines() == [str(site / "glotouch_bt" / "__init__.py"), "[]", "failure"]
        else:
            assert "retrieve: ok" in done.stdout


CODE_IN_DATA = ("pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "jsonpickle")
"""Modules whose reading of data can run code."""
SOCKETS = {"glotouch_backends/flexiv_xense/simulated/cell.py", "glotouch_backends/flexiv_xense/simulated/remote.py"}
"""Use `multiprocessing.connection` for its sockets; `send` and `recv`, which pickle, are banned there."""
OWN_WORKERS = {"glotouch_bt/campaign/workers.py"}
"""Pickles between a process and the workers that it has started itself, over a pipe without a name."""
BANNED_CALLS = {
    "eval", "exec", "os.system", "os.popen", "tempfile.mktemp", "yaml.load", "yaml.load_all", "yaml.unsafe_load",
    "yaml.full_load", "os.chmod", "os.umask",
}  # fmt: skip
"""Calls that run text as code, go through a shell, race for a file name, or open a file to others."""
TEST_CALLS = {"os.chmod", "os.umask"}
"""Banned calls that tests may use."""


def dangers(path: Path) -> Iterator[str]:
    """Yield what in a source file could run foreign code, or open a file to others."""
    name = shown(path)
    allowed = TEST_CALLS if name.startswith("tests/") else set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
            yield from (f"{name}:{node.lineno}: {m}" for m in modules if m.partition(".")[0] in CODE_IN_DATA)
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        given = {k.arg: ast.unparse(k.value) for k in node.keywords}
        pickles = name in SOCKETS and called.endswith(("connection.send", "connection.recv"))
        if called in BANNED_CALLS - allowed or pickles:
            yield f"{name}:{node.lineno}: {called}"
        if given.get("shell", "False") != "False" or given.get("allow_pickle", "False") != "False":
            yield f"{name}:{node.lineno}: {called} with {given}"


def test_nothing_runs_code_that_it_reads() -> None:
    found = [d for path in sources(*PACKAGES, "tests", "docs", "examples") for d in dangers(path)]
    assert found == []


def test_connections_that_could_pickle_are_known() -> None:
    users = {shown(p) for p in sources(*PACKAGES) if "multiprocessing.connection" in p.read_text()}
    assert users - OWN_WORKERS == SOCKETS


@pytest.mark.parametrize(
    "code",
    ["import pickle", "from pickle import loads", "eval('1')", "exec('1')", "subprocess.run('x', shell=True)",
     "os.system('x')", "np.load('x', allow_pickle=True)", "import marshal", "yaml.load(x, L)", "tempfile.mktemp()"],
)  # fmt: skip
def test_dangers_are_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    monkeypatch.setattr(sys.modules[__name__], "shown", str)
    (tmp_path / "x.py").write_text(code)
    assert list(dangers(tmp_path / "x.py"))
