"""Write the generated pages of the documentation, or check that the committed ones are up to date.

python docs/generate [reference | results | architecture]... [--check]
"""

from __future__ import annotations

import difflib
import sys
from pathlib import Path

import architecture
import program
import reference
import results

DOCS = Path(__file__).resolve().parents[1]
GROUPS = {
    "reference": lambda: reference.pages() | program.pages(),
    "results": results.pages,
    "architecture": architecture.pages,
}


def main(words: list[str]) -> int:
    """Write or check the pages of the named groups (default: all); 1 if a page differs or is left over."""
    groups = [w for w in words if w in GROUPS] or list(GROUPS)
    check = "--check" in words
    stale = 0
    for group in groups:
        pages = GROUPS[group]()
        for name, text in pages.items():
            path = DOCS / name
            old = path.read_text(encoding="utf-8") if path.is_file() else ""
            if old == text:
                continue
            stale += 1
            if check:
                changes = difflib.unified_diff(
                    old.splitlines(), text.splitlines(), f"docs/{name}", "generated", lineterm="", n=1
                )
                sys.stdout.write("\n".join(list(changes)[:40]) + "\n")
            else:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
        if group == "reference":
            for path in sorted((DOCS / "reference").glob("*.md")):
                if f"reference/{path.name}" not in pages:
                    stale += 1
                    sys.stdout.write(f"docs/reference/{path.name}: nothing generates this page\n")
    if check and stale:
        sys.stdout.write(f"{stale} pages differ from what is generated: run `make reference results-page`\n")
    return int(check and stale > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
