"""Copy measured summaries beside the documentation, with the commit, command, conditions and seeds that made them."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.campaign import CHANGED
from glotouch_bt.claims.run import MANIFEST_SCALE, SUMMARY, finished
from glotouch_bt.claims.table import COUNTS, Claim, made_by
from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import read_json

META = "meta.yaml"


def collect(claims: Mapping[str, Claim], out: Path, results: Path) -> tuple[list[str], list[str]]:
    """Copy the summaries of all measured claims to `results`/NAME; mark figures of other commits there as older.

    A claim's notes are kept if they were written for the same commit.

    Args:
        claims: The whole table.
        out: Folder of `run_claims`.
        results: Folder docs/results of a checkout.

    Returns:
        Names of the campaigns that were copied, and of those that the folder lacks.

    Raises:
        BadInput: `out` holds a small version, nothing finished, or figures of code that is not committed; or `results`
            is not the folder of a documentation.
    """
    if not results.is_dir():
        raise BadInput(f"--collect {results}: must be the folder docs/results of a clone of the repository")
    manifest = out / "campaign.json"
    scale = read_json(manifest).get(MANIFEST_SCALE) if manifest.is_file() else None
    if scale != 1.0:
        raise BadInput(f"{out}: holds no whole campaign (its scale is {scale}); measure without --scale")
    ends = {name: end for name, c in claims.items() if c.commands and (end := finished(out, name)) is not None}
    changed = [name for name, end in ends.items() if end["commit"].endswith(CHANGED)]
    if not ends or changed:
        what = (
            f"{', '.join(changed)} were measured with changes that are not committed" if changed else "is not finished"
        )
        raise BadInput(f"{out}: {what}; a published figure needs a commit")
    for name, end in ends.items():
        summary = read_json(out / name / SUMMARY)
        for shown in made_by(claims, name):
            (results / shown).mkdir(exist_ok=True)
            meta = described(claims[shown], end, summary)
            if (notes := _notes(results / shown / META, end["commit"])) is not None:
                meta["notes"] = notes
            text = yaml.safe_dump(meta, sort_keys=False, allow_unicode=True, width=150)
            (results / shown / META).write_text(text, encoding="utf-8")
            (results / shown / SUMMARY).unlink(missing_ok=True)
        shutil.copyfile(out / name / SUMMARY, results / name / SUMMARY)
        claim = claims[name]
        if claim.image and claim.picture and (out / name / claim.picture).is_file():
            shutil.copyfile(out / name / claim.picture, results.parent / claim.image)
    _mark_older(results, {end["commit"] for end in ends.values()})
    return list(ends), [name for name, c in claims.items() if c.commands and name not in ends]


def described(claim: Claim, end: Mapping[str, Any], summary: Any) -> dict[str, Any]:
    """Return what the page says about how a figure was made."""
    commands = [line.replace("{out}", "DIR").replace("{objects}", "OBJECTS") for line in end["commands"]]
    parts = list(claim.parts.values())
    commands = [line.replace("{part}", f"({' | '.join(parts)})") for line in commands]
    return {
        "command": "; ".join(commands),
        "commit": end["commit"],
        "conditions": claim.conditions,
        "seeds": seeds_of(end["commands"][-1], summary),
        "wall_min": round(end["wall_s"] / 60, 1),
    }


def seeds_of(line: str, summary: Any) -> str:
    """Return the seeds of a figure: those of its summary, else those that its command line names, else "none"."""
    if isinstance(summary, dict) and isinstance(summary.get("seeds"), list) and summary["seeds"]:
        seeds = sorted(summary["seeds"])
        return f"{seeds[0]}-{seeds[-1]}" if len(seeds) > 1 else str(seeds[0])
    words = shlex.split(line)
    options = dict(pairwise(words))
    if "--seed" not in options:
        return "none"
    first = int(options["--seed"])
    count = max((int(options[name]) for name in COUNTS[:4] if options.get(name, "").isdecimal()), default=1)
    return f"{first}-{first + count - 1}" if count > 1 else str(first)


def _notes(path: Path, commit: str) -> list[str] | None:
    if not path.is_file():
        return None
    found = yaml.safe_load(path.read_text(encoding="utf-8"))
    return found.get("notes") if found.get("commit") == commit else None


def _mark_older(results: Path, commits: set[str]) -> None:
    """Add `older: true` to the figures of other commits."""
    for path in results.glob(f"*/{META}"):
        text = path.read_text(encoding="utf-8")
        found = yaml.safe_load(text)
        if str(found["commit"]) not in commits and not found.get("older"):
            path.write_text(re.sub(r"^(seeds: .*\n)", r"\1older: true\n", text, count=1, flags=re.MULTILINE), "utf-8")
