"""The context in which a tree is read: known skills, keys of the present file, and counts over all files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from glotouch_bt.mission.spec import Findings, Node, Place, Wire
from glotouch_bt.robot import ObjectSet
from glotouch_bt.skill import Skill

KEY = re.compile(r"[a-z][A-Za-z0-9_]*")


@dataclass
class Reading:
    """Counts and subtrees that are gathered while one mission is read, its subtrees included.

    Attributes:
        nodes: Number of nodes read so far.
        depth: Depth of the node being read.
        subtrees, constants: Numbers read so far; keys are numbered by them, so they do not depend on file names.
        carried: The subtrees in the mission's own `subtrees` section, by name.
        used: Every subtree that was read, by its name in the document of the run.
        sources: The source of each: a file, or its name in the `subtrees` section.
        renamed: Place of each `file` setting: the name.
        files: Content of the files of subtrees; a mission may use one of them many times.
    """

    nodes: int = 0
    depth: int = 0
    subtrees: int = 0
    constants: int = 0
    carried: Mapping[str, Node] = field(default_factory=dict)
    used: dict[str, Node] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    renamed: dict[Place, str] = field(default_factory=dict)
    files: dict[Path, Node] = field(default_factory=dict)

    def carry(self, stem: str, source: str, tree: Node, at: Place) -> str:
        """Note a subtree that the node at `at` uses; return its name in the document of the run."""
        name, n = stem, 2
        while self.sources.get(name, source) != source:
            name, n = f"{stem}_{n}", n + 1
        self.sources[name], self.used[name], self.renamed[at] = source, tree, name
        return name


@dataclass(frozen=True)
class Scope:
    """The context in which a tree is read.

    Attributes:
        skills: Known skills.
        findings: Where faults go.
        file: The file being read; subtrees are found relative to it.
        roots: Folders in which the files of subtrees may be, besides the shipped one.
        objects: The world's objects, for parameters of type stl and count; None: the world is faulty.
        prefix: Prefix of private keys ("" in the mission itself).
        ports: Subtree key -> absolute key; None in the mission itself, where a key is its own name.
        trail: Files (or names of carried subtrees) being read, outermost first.
        reading: Counts over all files.
    """

    skills: Mapping[str, type[Skill]]
    findings: Findings
    file: Path
    roots: tuple[Path, ...] = ()
    objects: ObjectSet | None = None
    prefix: str = ""
    ports: Mapping[str, str] = field(default_factory=dict)
    trail: tuple[str, ...] = ()
    reading: Reading = field(default_factory=Reading)

    def key(self, name: str) -> str:
        """Return the absolute key of a name that is used in this tree."""
        return self.ports.get(name, self.prefix + name)

    def wire(self, port: str, key: str, place: Place) -> Wire | None:
        """Return a port wired to a key of this tree; None (and a finding) if that is not a key."""
        if not KEY.fullmatch(key):
            self.findings.add(
                place,
                "wrong_key",
                f"{key!r} is not a port key",
                valid="letters, digits and _, the first a small letter",
            )
            return None
        return Wire(port, self.key(key), place)
