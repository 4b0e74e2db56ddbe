"""Random scripts that tell two trees apart: the test a surviving mutant lacks, or a hint that there is none to lack."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args, get_origin

import numpy as np

from glotouch_bt.mission import Mission
from glotouch_bt.mission.spec import ConditionSettings, NodeSpec, TimeoutSettings
from glotouch_bt.mission_testing.call import Call
from glotouch_bt.mission_testing.casting import leaves_of
from glotouch_bt.mission_testing.coverage import expected_endings
from glotouch_bt.mission_testing.leaf import promised
from glotouch_bt.mission_testing.outcomes import Outcome
from glotouch_bt.mission_testing.scripted import RunsAway, ScriptedRun, run_scripted
from glotouch_bt.mission_testing.standins import port_value, stand_in
from glotouch_bt.skill import Skill

MAX_TICKS, MAX_STEPS = 3000, 6
RUNS_AWAY = "runs away"
Rows = Mapping[str, tuple[Outcome, ...]]


@dataclass(frozen=True)
class Difference:
    """A script under which two trees behave differently.

    Attributes:
        script: As Python text, to be put into a test.
        where: Where they part.
        before, after: What the original and the mutant do from there.
    """

    script: str
    where: str
    before: str
    after: str


def behaviour(run: ScriptedRun) -> tuple[Any, ...]:
    """What of a run a test can see: its end, the leaves' calls with what went in, the keys at the end.

    Values are compared by identity but for plain ones: two runs of one script write the same objects.
    """
    calls = tuple(
        (c.node, c.ending, c.code, repr(c.params), _seen(c.inputs), round(c.end_s - c.start_s, 3)) for c in run.calls
    )
    return RUNS_AWAY if isinstance(run.error, RunsAway) else run.status, run.code, calls, _seen(run.keys)


def _seen(value: object) -> Any:
    if isinstance(value, Mapping):
        return tuple(sorted((k, _seen(v)) for k, v in value.items()))
    if isinstance(value, tuple):
        return tuple(_seen(v) for v in value)
    # Types keep True apart from 1.
    return (type(value).__name__, value) if isinstance(value, (bool, int, float, str)) else ("object", id(value))


@dataclass
class ScriptMaker:
    """Makes random scripts for a mission.

    Args:
        mission: The mission.
    """

    mission: Mission
    _numbers: list[float] = field(init=False)
    _texts: list[str] = field(init=False)
    _seconds: float = field(init=False)
    _breakable: set[str] = field(init=False)
    _words: dict[int, tuple[object, str]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        numbers, texts, seconds = {0.0, 1.0, 2.0}, {"a", "b"}, [1.0]
        for node in self.mission.tree.walk():
            until = getattr(node.settings, "until", None)
            for s in (node.settings, until):
                if isinstance(s, ConditionSettings):
                    for value in (s.equals, s.at_least, s.at_most):
                        if isinstance(value, str):
                            texts.add(value)
                        elif value is not None and not isinstance(value, bool):
                            numbers |= {value - 1.0, 0.95 * value, float(value), 1.05 * value, value + 1.0}
            if isinstance(node.settings, TimeoutSettings):
                seconds.append(node.settings.seconds)
        self._numbers, self._texts, self._seconds = sorted(numbers), sorted(texts), 2.5 * max(seconds)
        endings = expected_endings(self.mission.tree, self.mission.name)
        self._breakable = {path for path, expected in endings if "PREEMPTED" in expected}

    def rows(self, rng: np.random.Generator) -> dict[str, tuple[Outcome, ...]]:
        """A random row of outcomes for each leaf, by its name; half of them always do the same."""
        wild = rng.uniform(0.05, 0.6)
        made = {}
        for path, node in leaves_of(self.mission.tree, self.mission.name).items():
            length = 1 if rng.random() < 0.5 else int(rng.integers(2, 6))
            made[node.name] = tuple(self._outcome(path, node, wild, rng) for _ in range(length))
        return made

    def _outcome(self, path: str, node: NodeSpec, wild: float, rng: np.random.Generator) -> Outcome:
        skill = node.skill_type
        assert skill is not None
        after = float(np.round(rng.uniform(0.0, self._seconds), 1)) if rng.random() < 0.15 else 0.0
        if path in self._breakable and rng.random() < 0.1:
            return Outcome("hangs")
        failing = rng.random() < wild
        kind: Literal["ok", "fails"] = "fails" if failing else "ok"
        ports = {
            p: self._port(skill, p, rng)
            for p in skill.OUTPUT_PORTS
            if promised(skill, p, kind) is None and (not failing or rng.random() < 0.3)
        }
        codes = list(skill.FAILURES) or [""]
        code = codes[int(rng.integers(len(codes)))] if failing else ""
        return Outcome(kind, code, ports=ports, after_s=after)

    def _port(self, skill: type[Skill], port: str, rng: np.random.Generator) -> object:
        kind: Any = skill.OUTPUT_PORTS[port].data_type
        if kind is tuple:
            element: Any = getattr(getattr(skill, port), "element", None) or object
            items = [self._object(element, rng) for _ in range(int(rng.choice([0, 1, 2, 3], p=[0.1, 0.4, 0.3, 0.2])))]
            return self._worded(tuple(items), f"({''.join(self._word(i) + ', ' for i in items).rstrip()})")
        return self._object(kind, rng)

    def _object(self, kind: Any, rng: np.random.Generator) -> object:
        if kind is bool:
            return bool(rng.random() < 0.5)
        if kind is int:
            return int(rng.choice(self._numbers))
        if kind is float:
            return float(rng.choice(self._numbers))
        if kind is str:
            return str(rng.choice(self._texts))
        if get_origin(kind) is Literal:
            return get_args(kind)[int(rng.integers(len(get_args(kind))))]
        return self._instance(kind, rng)

    def _instance(self, kind: Any, rng: np.random.Generator) -> object:
        """A value of its own, its number fields drawn."""
        numbers = {
            f: float(np.round(rng.random(), 2))
            for f, t in getattr(kind, "__annotations__", {}).items()
            if t in (float, "float")
        }
        name = getattr(kind, "__name__", "object")
        if kind is object:
            return self._worded(object(), "object()")
        if not numbers or not hasattr(kind, "__dataclass_fields__"):
            # Not from the cache: which of two values came is told by identity.
            return self._worded(port_value.__wrapped__(kind, None), f"stand_in({name})")
        shown = ", ".join(f"{k}={v!r}" for k, v in numbers.items() if k == self._ordered_by())
        return self._worded(stand_in(kind, **numbers), f"stand_in({', '.join(filter(None, [name, shown]))})")

    def _ordered_by(self) -> str:
        found = (getattr(n.settings, "least_first", None) for n in self.mission.tree.walk())
        return next((f for f in found if f), "")

    def _worded(self, value: object, word: str) -> object:
        self._words[id(value)] = (value, word)
        return value

    def _word(self, value: object) -> str:
        return self._words[id(value)][1] if id(value) in self._words else repr(value)

    def shown(self, rows: Rows) -> str:
        """Rows as Python text."""
        lines = []
        for name, row in rows.items():
            outcomes = [self._shown(o) for o in row]
            lines.append(f"{name!r}: {outcomes[0] if len(outcomes) == 1 else '[' + ', '.join(outcomes) + ']'}")
        return "{" + ", ".join(lines) + "}"

    def _shown(self, outcome: Outcome) -> str:
        words = [repr(outcome.code)] if outcome.code else []
        words += [f"{p}={self._word(v)}" for p, v in outcome.ports.items()]
        after = f".after({outcome.after_s:g})" if outcome.after_s else ""
        return f"{outcome.kind}({', '.join(words)}){after}"


class Search:
    """Looks for a script that tells mutants of a mission from it; runs of the mission itself are kept.

    Args:
        mission: The mission as it is.
        scripts: How many scripts are tried for each mutant.
        seed: Of the random scripts.
    """

    def __init__(self, mission: Mission, scripts: int = 300, seed: int = 0) -> None:
        self._mission, self._maker = mission, ScriptMaker(mission)
        self._scripts, self._rng = scripts, np.random.default_rng(seed)
        self._known: list[tuple[Rows, tuple[Any, ...]]] = []

    def difference(self, tree: NodeSpec) -> Difference | None:
        """The shortest script found under which a tree does something else than the mission's; None if none was."""
        mutant = replace(self._mission, tree=tree)
        for i in range(self._scripts):
            if i == len(self._known):
                rows: Rows = self._maker.rows(self._rng)
                self._known.append((rows, behaviour(self._run(self._mission, rows))))
            rows, expected = self._known[i]
            if self._differs(mutant, rows, expected):
                rows = self._shortened(mutant, rows)
                told = _told(self._run(self._mission, rows), self._run(mutant, rows))
                return Difference(self._maker.shown(rows), *told)
        return None

    def _run(self, mission: Mission, rows: Rows) -> ScriptedRun:
        known = {n.name for n in mission.tree.walk() if n.kind == "skill"}
        return run_scripted(mission, {n: r for n, r in rows.items() if n in known}, max_ticks=MAX_TICKS)

    def _differs(self, mutant: Mission, rows: Rows, expected: tuple[Any, ...] | None = None) -> bool:
        here = behaviour(self._run(self._mission, rows)) if expected is None else expected
        there = behaviour(self._run(mutant, rows))
        # Both may go on for ever, and have got to different places when that is noticed.
        return here != there and RUNS_AWAY not in (here[0], there[0])

    def _shortened(self, mutant: Mission, rows: Rows) -> Rows:
        """What can be left out without losing the difference is left out."""
        again = True
        while again:
            again = False
            for less in _less(rows):
                if self._differs(mutant, less):
                    rows, again = less, True
                    break
        return rows


def _less(rows: Rows) -> Iterator[Rows]:
    """The same rows with one thing less."""
    for name, row in rows.items():
        yield {n: r for n, r in rows.items() if n != name}
        for i, outcome in enumerate(row):
            if len(row) > 1:
                yield {**rows, name: row[:i] + row[i + 1 :]}
            if outcome.after_s:
                yield {**rows, name: (*row[:i], replace(outcome, after_s=0.0), *row[i + 1 :])}
            for port in outcome.ports:
                ports = {p: v for p, v in outcome.ports.items() if p != port}
                yield {**rows, name: (*row[:i], replace(outcome, ports=ports), *row[i + 1 :])}


def _told(before: ScriptedRun, after: ScriptedRun) -> tuple[str, str, str]:
    """(where they part, what the one does from there, what the other does)."""
    one, two = ([_step(c) for c in run.calls] for run in (before, after))
    same = next((i for i, (a, b) in enumerate(zip(one, two, strict=False)) if a != b), min(len(one), len(two)))
    if one != two or (before.status, before.code) != (after.status, after.code):
        where = f"after {same} calls" if same else "at once"
        return where, _rest(before, one[same:]), _rest(after, two[same:])
    for a, b in zip(before.calls, after.calls, strict=True):
        for port in {**a.inputs, **b.inputs}:
            if _seen(a.inputs.get(port)) != _seen(b.inputs.get(port)):
                return f"in what {a.node!r} (call {a.number + 1}) is given as {port!r}", "one value", "another"
        if repr(a.params) != repr(b.params):
            return f"in the parameters of {a.node!r}", str(a.params), str(b.params)
        if a.end_s - a.start_s != b.end_s - b.start_s:
            return f"in how long {a.node!r} runs", f"{a.end_s - a.start_s:g} s", f"{b.end_s - b.start_s:g} s"
    keys = [k for k in {**before.keys, **after.keys} if _seen(before.keys.get(k)) != _seen(after.keys.get(k))]
    return f"in the keys at the end: {', '.join(keys)}", "one value", "another"


def _step(call: Call) -> str:
    return call.node + ("" if call.ending == "SUCCESS" else f"[{call.code or call.ending}]")


def _rest(run: ScriptedRun, steps: list[str]) -> str:
    shown = " ".join(steps[:MAX_STEPS]) + (f" and {len(steps) - MAX_STEPS} more" if len(steps) > MAX_STEPS else "")
    return f"{shown or 'no more calls'}: {run.status}{f' ({run.code})' if run.code else ''}"
