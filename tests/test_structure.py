"""Rules of the layout that a tool can check: doors, folder sizes, unique class names, standard words."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends")
MAX_FILES = 15
"""Largest number of .py files in one folder, its `__init__.py` included."""
VENDOR_API = "glotouch_backends.flexiv_xense.simulated.vendor_api"
"""Stands in for the vendors' modules: imported as modules, with the vendors' class names."""
FILES = {p: p.relative_to(ROOT) for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))}


def module_of(path: Path) -> str:
    """Dotted name of a source file."""
    parts = FILES[path].with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(p): p for p in FILES}
FOLDERS = {m for m, p in MODULES.items() if p.name == "__init__.py"}


def folder_of(module: str) -> str:
    """The folder a module lives in; a folder lives in itself."""
    return module if module in FOLDERS else module.rsplit(".", 1)[0]


@cache
def offered(folder: str) -> set[str]:
    """Names that a door offers itself; one may be named like the file it comes from."""
    body = ast.parse(MODULES[folder].read_text()).body
    return {a.asname or a.name for n in body if isinstance(n, ast.ImportFrom) for a in n.names}


def imported(path: Path) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything of ours that a file imports."""
    here = folder_of(module_of(path)).split(".")
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [a.name for a in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(here[: len(here) - node.level + 1]) if node.level else ""
            source = ".".join(filter(None, (base, node.module)))
            exported = offered(source) if source in FOLDERS else set()
            inside = [f"{source}.{a.name}" for a in node.names if a.name not in exported]
            names = [source, *(n for n in inside if n in MODULES)]
        else:
            continue
        yield from ((node.lineno, n) for n in dict.fromkeys(names) if n in MODULES)


def test_imports_go_through_doors() -> None:
    """A file imports files of its own folder and of the folders above it; of any other folder only the door."""
    past = []
    for path in FILES:
        here = folder_of(module_of(path))
        for line, name in imported(path):
            folder = folder_of(name)
            if name in FOLDERS or folder in (here, VENDOR_API) or here.startswith(f"{folder}."):
                continue
            past.append(f"{FILES[path]}:{line}: {name}")
    assert past == [], "import from the folder's door instead"


def test_folders_stay_small() -> None:
    counted = Counter(p.parent.relative_to(ROOT) for p in FILES)
    assert {str(f): n for f, n in counted.items() if n > MAX_FILES} == {}, "split them"


@pytest.mark.parametrize("folder", sorted(FOLDERS))
def test_every_folder_says_what_may_live_there(folder: str) -> None:
    said = ast.get_docstring(ast.parse(MODULES[folder].read_text())) or ""
    assert said
    assert "TODO" not in said


def test_class_names_are_unique() -> None:
    defined: dict[str, list[str]] = {}
    for path in FILES:
        if module_of(path).startswith(VENDOR_API):
            continue
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef):
                defined.setdefault(node.name, []).append(str(FILES[path]))
    assert {n: where for n, where in defined.items() if len(where) > 1} == {}


def test_standard_words_are_used() -> None:
    """`max_` and `min_`, as everywhere else."""
    pattern = re.compile(r"\b_?(?:most|least|MOST|LEAST)_(?!common\b|squares\b)\w+|\b_(?:most|least)\b")
    used = {str(r): sorted(set(found)) for p, r in FILES.items() if (found := pattern.findall(p.read_text()))}
    assert used == {}


def test_docstrings_name_the_thing() -> None:
    """A docstring says what the thing is or does; a question word begins no such sentence."""
    asking = ("What", "How", "Where", "Whether", "Which", "Why")
    found = []
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                said = ast.get_docstring(node) or ""
                if said.split(maxsplit=1)[:1] and said.split(maxsplit=1)[0] in asking:
                    found.append(f"{FILES[path]}: {said.splitlines()[0]}")
    assert found == []
