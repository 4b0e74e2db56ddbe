"""The table of claims: what each figure shows, and the commands that measure it. `claims.yaml` describes its keys."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from glotouch_bt.robot import BadInput, UnknownName

TABLE = Path(__file__).with_name("claims.yaml")
COUNTS = ("--trials", "--planar", "--phases", "--boxes", "--shapes", "--kills", "--duration")
"""Options whose number `scaled` changes."""
SMALL_SEEDS = 1_000_000
"""Added to the seeds of a small version."""
_SEED = re.compile(r"--seed (\d+)(?!\S)")
_COUNT = re.compile(rf"(?<!\S)({'|'.join(COUNTS)}) (\d+)(?!\S)")


def _lines(value: object) -> object:
    return [value] if isinstance(value, str) else value


class Claim(BaseModel):
    """An entry of the table.

    Attributes:
        section, order, title, claim: Where and how the page of results shows it.
        commands: Command lines, run one after another; the last leaves summary.json or prints it as JSON.
        uses: Name of the claim whose summary this one shows too; instead of commands.
        parts: Text of `{part}` in the commands, by the part's name; summary.json then holds summaries by name.
        minutes: Expected wall time on two cores.
        small: Words added to the last command of a small version.
        conditions: Conditions, as the page names them.
        columns: Column title: path in summary.json.
        rows: Label, path in the column, unit, digits, and what was wanted.
        image: Picture of the page, below docs.
        picture: Name of that picture in the campaign's folder.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    section: str
    order: float
    title: str
    claim: str
    commands: Annotated[tuple[str, ...], BeforeValidator(_lines)] = ()
    uses: str | None = None
    parts: Mapping[str, str] = Field(default_factory=dict)
    minutes: float = Field(default=0.0, ge=0.0)
    small: str = ""
    conditions: str
    columns: Mapping[str, str] = Field(default_factory=dict)
    rows: tuple[Mapping[str, Any], ...]
    image: str | None = None
    picture: str | None = None

    @model_validator(mode="after")
    def _has_one_source(self) -> Claim:
        if bool(self.commands) == bool(self.uses):
            raise ValueError("must have either commands or uses")
        return self

    def lines(self, scale: float = 1.0) -> tuple[str, ...]:
        """Return the command lines of the whole figure, or of a small version of it."""
        lines = [scaled(line, scale) for line in self.commands]
        if scale < 1.0 and self.small and lines:
            lines[-1] += f" {self.small}"
        return tuple(lines)


def read_claims(path: Path | None = None) -> dict[str, Claim]:
    """Return the claims of a table by name, in the order in which they are measured.

    Args:
        path: A YAML file; None: the table of this package.

    Raises:
        BadInput: The file cannot be read, or an entry is wrong; the message names it.
    """
    path = path or TABLE
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as e:
        raise BadInput(f"{path}: is not a readable table of figures ({e})") from e
    if not isinstance(entries, dict) or not entries:
        raise BadInput(f"{path}: must be a mapping from names to figures, such as those of {TABLE.name}")
    found: dict[str, Claim] = {}
    for name, entry in entries.items():
        if not str(name).replace("_", "").isalnum():
            raise BadInput(f"{path}: {name}: a name has letters, digits and _ only")
        try:
            found[str(name)] = Claim.model_validate(entry)
        except ValidationError as e:
            wrong = "; ".join(f"{'.'.join(map(str, x['loc'])) or 'entry'}: {x['msg']}" for x in e.errors())
            raise BadInput(f"{path}: {name}: {wrong}") from e
    for name, claim in found.items():
        if claim.uses is not None and (claim.uses not in found or found[claim.uses].uses):
            raise BadInput(f"{path}: {name}: uses {claim.uses}, which is no entry with commands")
    return found


def chosen(claims: Mapping[str, Claim], names: Sequence[str]) -> dict[str, Claim]:
    """Return the claims with commands among `names` (default: all), in the order of the table.

    Raises:
        UnknownName: One is not in the table.
    """
    for name in names:
        if name not in claims:
            raise UnknownName("figure", name, tuple(claims))
    wanted = {claims[name].uses or name for name in names}
    return {name: c for name, c in claims.items() if c.commands and (not names or name in wanted)}


def made_by(claims: Mapping[str, Claim], name: str) -> tuple[str, ...]:
    """Return the names of the claims that show the summary of a campaign, its own first."""
    return (name, *(other for other, c in claims.items() if c.uses == name))


def scaled(line: str, scale: float) -> str:
    """Return a command line with its numbers of trials (`COUNTS`) times `scale`, rounded up; 0 stays 0.

    A small version has other seeds, so that trying a command does not show the layouts of the figure.

    Raises:
        BadInput: The scale is not in (0, 1].
    """
    if not 0.0 < scale <= 1.0:
        raise BadInput(f"--scale {scale:g}: must be above 0 and at most 1")
    if scale == 1.0:
        return line
    line = _SEED.sub(lambda found: f"--seed {int(found[1]) + SMALL_SEEDS}", line)
    return _COUNT.sub(lambda found: f"{found[1]} {math.ceil(int(found[2]) * scale)}", line)
