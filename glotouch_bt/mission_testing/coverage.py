"""LeafOutcome coverage: which endings of each leaf of a mission the tests of a session have exercised."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from glotouch_bt.mission import Mission
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.read import shown
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.mission_testing.scripted import ScriptedRun

SUCCESS, FAILURE, PREEMPTED = "SUCCESS", "FAILURE", "PREEMPTED"
Plain = dict[str, dict[str, dict[str, list[str]]]]


@dataclass
class Leaf:
    """Expected and observed endings of one leaf.

    Attributes:
        expected: SUCCESS, every failure code the skill declares (or FAILURE, if it declares none), and PREEMPTED where
            a node above may preempt it.
        seen: Endings that happened.
    """

    expected: tuple[str, ...]
    seen: set[str] = field(default_factory=set)

    @property
    def missing(self) -> list[str]:
        """Return the endings that no test exercised."""
        return [e for e in self.expected if e not in self.seen]


class OutcomeCoverage:
    """Collects the endings of scripted runs.

    Attributes:
        missions: For each mission's file, its leaves by path.
    """

    def __init__(self) -> None:
        self.missions: dict[str, dict[str, Leaf]] = {}

    def add(self, mission: Mission, run: ScriptedRun) -> None:
        """Add the calls of a run."""
        leaves = self.missions.setdefault(shown(mission.file), {})
        for path, expected in expected_endings(mission.spec, mission.name):
            leaves.setdefault(path, Leaf(expected))
        for call in run.calls:
            ending = call.ending
            if ending == FAILURE and call.code in leaves[call.path].expected:
                ending = call.code  # type: ignore[assignment]
            leaves[call.path].seen.add(ending)

    def exercised(self) -> tuple[int, int]:
        """Return (endings exercised, endings expected)."""
        leaves = [leaf for mission in self.missions.values() for leaf in mission.values()]
        return sum(len(x.expected) - len(x.missing) for x in leaves), sum(len(x.expected) for x in leaves)

    @property
    def percent(self) -> float:
        """Return the percentage of endings exercised; 100 if there are none."""
        done, total = self.exercised()
        return 100.0 * done / total if total else 100.0

    def lines(self) -> Iterator[str]:
        """Yield the lines of the coverage table."""
        for name, leaves in self.missions.items():
            done = sum(len(x.expected) - len(x.missing) for x in leaves.values())
            total = sum(len(x.expected) for x in leaves.values())
            yield f"{name}: {done} of {total} outcomes exercised ({100.0 * done / max(total, 1):.0f} %)"
            width = max((len(p.rsplit("/", 1)[-1]) for p in leaves), default=4)
            for path, leaf in leaves.items():
                yield f"  {path.rsplit('/', 1)[-1]:{width}s}  {_cells(leaf)}"

    def plain(self) -> Plain:
        """Return JSON data, to send between the processes of a session."""
        return {
            m: {p: {"expected": list(x.expected), "seen": sorted(x.seen)} for p, x in leaves.items()}
            for m, leaves in self.missions.items()
        }

    def merge(self, other: Plain) -> None:
        """Add the data of another process."""
        for mission, leaves in other.items():
            mine = self.missions.setdefault(mission, {})
            for path, leaf in leaves.items():
                mine.setdefault(path, Leaf(tuple(leaf["expected"]))).seen.update(leaf["seen"])


def _cells(leaf: Leaf) -> str:
    codes = [e for e in leaf.expected if e not in (SUCCESS, PREEMPTED)]
    cells = [
        "success" if SUCCESS in leaf.seen else "success -",
        f"failure {sum(c in leaf.seen for c in codes)}/{len(codes)}",
    ]
    if PREEMPTED in leaf.expected:
        cells.append("preempted" if PREEMPTED in leaf.seen else "preempted -")
    missing = [m for m in leaf.missing if m in codes]
    return "  ".join(f"{c:11s}" for c in cells) + (f"  missing: {', '.join(missing)}" if missing else "")


def expected_endings(root: NodeSpec, title: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield (path, expected endings) of every leaf."""
    paths = root.paths(title)
    for path, node in paths.items():
        if node.skill_type is None:
            continue
        codes = tuple(node.skill_type.failures()) or (FAILURE,)
        preempted = (PREEMPTED,) if _below(path, paths) else ()
        yield path, (SUCCESS, *codes, *preempted)


def _below(path: str, paths: Mapping[str, NodeSpec]) -> bool:
    return any(kind_of(node).preempts and path.startswith(above + "/") for above, node in paths.items())
