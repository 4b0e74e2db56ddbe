"""Generated pages are up to date; links, files and modules that a page names exist; the site builds."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import yaml

import glotouch_bt as gt
from glotouch_bt.claims import Claim, read_claims

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("docs/**/*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
FILE = re.compile(r"\b(?:glotouch_(?:bt|skills|backends|missions)|docs)/[\w/.*-]*\w")
MODULE = re.compile(r"\bglotouch_(?:bt|skills|backends)(?:\.[a-z_]\w*)+")
LINK = re.compile(r"\]\((?!https?:|#|\.\./\.\.)([^)#\s]+)")
CODE = re.compile(r"^```.*?^```|^    .*?$|`[^`\n]*`", re.DOTALL | re.MULTILINE)
PLACEHOLDER = re.compile(r"\b[A-Z]{3,}\b")
GROUPS = ("skills", "backends", "matchers", "search_policies")
ENTRY_POINT_GROUPS = tuple(f"glotouch_bt.{group}" for group in GROUPS)
ATTRIBUTE_DEPTH = 2
"""Number of trailing words of a dotted name that may be attributes instead of modules."""


def shown(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.study
@pytest.mark.parametrize("group", ["reference", "results", "architecture"])
def test_generated_pages_are_up_to_date(group: str) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(ROOT / "docs/generate"), group, "--check"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("page", PAGES, ids=shown)
def test_files_and_links_of_a_page_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    missing = [name for name in FILE.findall(text) if not list(ROOT.glob(name)) and not PLACEHOLDER.search(name)]
    missing += [link for link in LINK.findall(CODE.sub("", text)) if not (page.parent / link).exists()]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=shown)
def test_modules_of_a_page_exist(page: Path) -> None:
    missing = []
    for name in sorted(set(MODULE.findall(page.read_text(encoding="utf-8")))):
        words = name.split(".")
        files = [ROOT.joinpath(*words[: len(words) - i]) for i in range(ATTRIBUTE_DEPTH + 1) if len(words) - i > 1]
        if name not in ENTRY_POINT_GROUPS and not any(f.is_dir() or f.with_suffix(".py").is_file() for f in files):
            missing.append(name)
    assert missing == []


def test_the_mission_of_the_readme_has_no_finding(tmp_path: Path) -> None:
    (block,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "survey.yaml").write_text(textwrap.dedent(block), encoding="utf-8")
    assert gt.check(tmp_path / "survey.yaml") == ()


def test_every_page_is_in_the_navigation() -> None:
    listed = set(re.findall(r"[\w/.-]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")))
    assert listed == {str(p.relative_to(ROOT / "docs")) for p in ROOT.glob("docs/**/*.md")}


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return read_claims()


@pytest.mark.parametrize("meta", sorted(ROOT.glob("docs/results/*/meta.yaml")), ids=lambda p: p.parent.name)
def test_every_claim_names_command_commit_conditions_and_seeds(meta: Path, claims: dict[str, Claim]) -> None:
    claim = claims.get(meta.parent.name)
    entry = {} if claim is None else claim.model_dump(exclude_defaults=True)
    given = entry | yaml.safe_load(meta.read_text(encoding="utf-8"))
    assert all(
        given.get(key) for key in ("section", "title", "claim", "command", "commit", "conditions", "seeds", "rows")
    )


@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="mkdocs is not installed: make dev")
def test_the_site_builds_strictly_and_loads_nothing_from_the_network(tmp_path: Path) -> None:
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    loaded = re.compile(r"<(?:script|img|link|iframe)\b[^>]*(?:src|href)=[\"']?(?:https?:)?//[^>]*>")
    outside = {page.name: found for page in tmp_path.rglob("*.html") if (found := loaded.findall(page.read_text()))}
    assert {k: [f for f in v if "canonical" not in f] for k, v in outside.items()} == {}
