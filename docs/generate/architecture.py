"""The generated section of docs/architecture.md: the layers of the import contracts, and a sentence for each folder."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

from markdown_text import code, table

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends", "glotouch_missions")
BEGIN, END = "<!-- generated: layers and folders -->\n", "<!-- end of the generated part -->\n"


def pages() -> dict[str, str]:
    """Return docs/architecture.md with its generated part replaced."""
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return {"architecture.md": f"{before}{BEGIN}\n{layers()}\n{folders()}\n{END}{after}"}


def layers() -> str:
    """Return the import contracts of pyproject.toml."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    text = ["### Layers\n", "A layer imports only from layers below it.\n"]
    for contract in contracts:
        if contract["type"] == "layers":
            shown = "\n".join(f"    {layer}" for layer in contract["layers"])
            text.append(f"**{contract['name']}**\n\n{shown}\n")
    rows = [
        (c["name"], _names(c["source_modules"]), _names(c["forbidden_modules"]))
        for c in contracts
        if c["type"] == "forbidden"
    ]
    return "\n".join([*text, "### Forbidden imports\n", table(("rule", "these", "do not import"), rows)])


def _names(modules: list[str]) -> str:
    return ", ".join(code(m) for m in modules)


def folders() -> str:
    """Return one sentence for each folder, the first of its door's docstring."""
    rows = []
    for package in PACKAGES:
        for door in sorted((ROOT / package).rglob("__init__.py")):
            text = ast.get_docstring(ast.parse(door.read_text(encoding="utf-8"))) or ""
            rows.append((code(f"{door.parent.relative_to(ROOT)}/"), " ".join(text.split("\n\n")[0].split())))
    return "### Folders\n\n" + table(("folder", "what may live there"), sorted(rows))
