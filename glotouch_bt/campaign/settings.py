"""The settings of a campaign of missions, the part of it that one command runs, and the check of its folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from glotouch_bt.campaign.identity import (
    conditions_digest,
    described_code,
    difference,
    digest,
    folder_digests,
    plain,
)
from glotouch_bt.campaign.trial import Row, Trial
from glotouch_bt.campaign.trial_folder import CLAIM, claimed
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import RunFolder, RunRequest
from glotouch_bt.untrusted import read_json

MANIFEST = "campaign.json"
"""Name of the file that says which campaign a folder holds."""


@dataclass(frozen=True)
class Shard:
    """A share of the trials of a campaign: every `count`-th, beginning with number `index` (from 1)."""

    index: int
    count: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Read I/N.

        Raises:
            BadInput: It is not I/N with 1 <= I <= N.
        """
        one, slash, two = text.partition("/")
        if not (slash and one.isdecimal() and two.isdecimal() and 1 <= int(one) <= int(two)):
            raise BadInput(f"--shard {text}: must be I/N with 1 <= I <= N, such as 2/8")
        return cls(int(one), int(two))

    def takes(self, number: int) -> bool:
        """Return True for a trial of this share, by its number from 0."""
        return number % self.count == self.index - 1


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Settings of a campaign of missions.

    Attributes:
        mission: Path or shipped name.
        seeds: Seeds of the trials.
        out: Folder of the campaign; it receives a folder for each trial.
        settings: `--set` values of every trial.
        conditions: Path or shipped name.
        objects: Folder of STL files instead of the world's.
        world: Path or shipped name of a world instead of the mission's.
        backend: Registered name.
        resume: Keep the trials that are finished in `out`.
        shard: Run this share of the trials only; the folder keeps those of other shares.
    """

    mission: str
    seeds: Sequence[int]
    out: Path
    settings: Mapping[str, str] = field(default_factory=dict)
    conditions: str = "nominal"
    objects: Path | None = None
    world: str | None = None
    backend: str = "mujoco"
    resume: bool = False
    shard: Shard | None = None

    def request(self, seed: int, name: str, **changes: Any) -> RunRequest:
        """Return the request of a trial in the folder `name`; `changes` are further fields of the request."""
        given: dict[str, Any] = {"settings": self.settings, "objects": self.objects, "world": self.world}
        given |= {"conditions": self.conditions, "out": self.out / name, "overwrite": True}
        return RunRequest(self.mission, self.backend, seed, **given | changes)

    def described(self) -> dict[str, Any]:
        """Return the settings that every summary.json repeats."""
        world = {} if self.world is None else {"world": self.world}
        return {"mission": self.mission, **world, "conditions": self.conditions, "seeds": list(self.seeds)}

    def trial(self, name: str, run: Callable[[], Row], failed: Callable[[Exception], Row], **given: Any) -> Trial:
        """Return a trial that is no run of a mission: its row depends on the campaign and on `given`."""
        return Trial(self.out / name, plain(self.identity | given), run, failed)

    @cached_property
    def identity(self) -> dict[str, Any]:
        """Return what all trials of the folder have in common: code, settings, objects; not which trials there are."""
        files = {"mission": self.mission, "world": self.world}
        return {
            "campaign": type(self).__name__,
            "backend": self.backend,
            "settings": dict(self.settings),
            "conditions": self.conditions,
            **files,
            "content": {name: _digest_of(path) for name, path in files.items()}
            | {"conditions": conditions_digest(self.conditions)}
            | {f"object {name}": found for name, found in folder_digests(self.objects).items()},
            **described_code(),
        }

    @property
    def keeps(self) -> bool:
        """True if the folder may hold trials: a share of a campaign continues the others."""
        return self.resume or self.shard is not None

    def open(self) -> None:
        """Prepare the folder: check that it holds this campaign, or without `resume` and `shard` no trial.

        Raises:
            BadInput: It holds another campaign (the message names the differences), or trials that are not to be kept.
        """
        open_folder(self.out, self.identity, keep=self.keeps)


def open_folder(folder: Path, identity: Mapping[str, Any], *, keep: bool) -> None:
    """Prepare the folder of a campaign; see `Campaign.open`.

    Args:
        folder: The folder.
        identity: Code, settings and objects that all its trials share.
        keep: Keep finished trials.
    """
    asked = plain(identity)
    with claimed(folder, wait=True):
        there = folder / MANIFEST
        if keep and there.is_file():
            if (kept := read_json(there)) != asked:
                told = difference(kept, asked) if isinstance(kept, dict) else "it cannot be read"
                raise BadInput(
                    f"{folder}: holds another campaign: {told}; "
                    "continue with the same code and options, or give another folder"
                )
            return
        if not keep and (begun := sum(claim.parent != folder for claim in folder.rglob(CLAIM))):
            raise BadInput(
                f"{folder}: already holds trials ({begun}); add --resume to continue with them, or give another folder"
            )
        RunFolder(folder).write_text(MANIFEST, json.dumps(asked, indent=1) + "\n")


def _digest_of(path: str | None) -> str | None:
    """Return the digest of a file; None for a shipped name, whose content belongs to the code."""
    return digest(Path(path).read_bytes()) if path is not None and Path(path).is_file() else None
