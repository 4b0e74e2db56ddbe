"""The figures of the paper beside ours, from `paper.yaml` and the committed summaries."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from figures import figure, value_at
from markdown_text import table

FACTS = Path(__file__).with_name("paper.yaml")
HEAD = """## The paper's figures beside ours

The paper is GLoTouch, whose method this project builds on. The paper's figures are read from its tables, ours from
the sections that follow, which name command, commit and seeds. An empty cell is not measured.
"""


def beside_ours(claims: Mapping[str, dict[str, Any]], summaries: Mapping[str, Any]) -> str:
    """Return the section: one table a subject, the claims it uses, and how the two worlds differ."""
    facts = yaml.safe_load(FACTS.read_text(encoding="utf-8"))
    text = [HEAD]
    for part in facts["tables"]:
        used: dict[str, None] = {}
        rows = [[row["label"], *(_cell(row.get(key), summaries, used) for key in part["columns"].values())]
                for row in part["rows"]]  # fmt: skip
        text += [f"### {part['title']}\n", table(("", *part["columns"]), rows)]
        if used:
            text.append(f"Ours from: {'; '.join(_source(claims[name]) for name in used)}.\n")
    differences = "\n".join(f"- {line}" for line in facts["differences"])
    return "\n".join([*text, f"### How the two worlds differ\n\n{differences}\n"])


def _cell(given: Any, summaries: Mapping[str, Any], used: dict[str, None]) -> str:
    """Return a fact as it stands, or the first of several figures that is measured."""
    if not isinstance(given, list):
        return "" if given is None else str(given)
    for name, path in given:
        found = value_at(summaries.get(name), path)
        if found is not None:
            used[name] = None
            return figure(found, {})
    return ""


def _source(claim: Mapping[str, Any]) -> str:
    return f"{claim['title']} (commit {claim['commit']}{', older code' if claim.get('older') else ''})"
