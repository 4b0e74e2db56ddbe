"""Random scripts: outcomes of a mission's leaves drawn at random, for campaigns that look for crashes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, get_args, get_origin

import numpy as np

from glotouch_bt.mission import Mission
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.mission_testing.casting import leaves_of
from glotouch_bt.mission_testing.coverage import expected_endings
from glotouch_bt.mission_testing.leaf import promised
from glotouch_bt.mission_testing.outcomes import LeafOutcome
from glotouch_bt.mission_testing.standins import port_value, stand_in
from glotouch_bt.skill import Skill


@dataclass
class ScriptMaker:
    """Draws random scripts for a mission, with port values near the constants it compares them with."""

    mission: Mission
    _numbers: list[float] = field(init=False)
    _texts: list[str] = field(init=False)
    _seconds: float = field(init=False)
    _breakable: set[str] = field(init=False)

    def __post_init__(self) -> None:
        numbers, texts, seconds = {0.0, 1.0, 2.0}, {"a", "b"}, [1.0]
        for node in self.mission.spec.walk():
            kind = kind_of(node)
            _, compared = kind.comparison(node) or ("", None)
            for value in (compared.equals, compared.at_least, compared.at_most) if compared else ():
                if isinstance(value, str):
                    texts.add(value)
                elif value is not None and not isinstance(value, bool):
                    numbers |= {value - 1.0, 0.95 * value, float(value), 1.05 * value, value + 1.0}
            limit_s = kind.time_limit_s(node)
            if limit_s is not None:
                seconds.append(limit_s)
        self._numbers, self._texts, self._seconds = sorted(numbers), sorted(texts), 2.5 * max(seconds)
        endings = expected_endings(self.mission.spec, self.mission.name)
        self._breakable = {path for path, expected in endings if "PREEMPTED" in expected}

    def rows(self, rng: np.random.Generator) -> dict[str, tuple[LeafOutcome, ...]]:
        """Return a random row of outcomes for each leaf, by its name; half of the leaves repeat one outcome."""
        wild = rng.uniform(0.05, 0.6)
        made = {}
        for path, node in leaves_of(self.mission.spec, self.mission.name).items():
            length = 1 if rng.random() < 0.5 else int(rng.integers(2, 6))
            made[node.name] = tuple(self._outcome(path, node, wild, rng) for _ in range(length))
        return made

    def _outcome(self, path: str, node: NodeSpec, wild: float, rng: np.random.Generator) -> LeafOutcome:
        skill = node.skill_type
        assert skill is not None
        after = float(np.round(rng.uniform(0.0, self._seconds), 1)) if rng.random() < 0.15 else 0.0
        if path in self._breakable and rng.random() < 0.1:
            return LeafOutcome("hangs")
        failing = rng.random() < wild
        kind: Literal["ok", "fails"] = "fails" if failing else "ok"
        ports = {
            p: self._port(skill, p, rng)
            for p in skill.OUTPUT_PORTS
            if promised(skill, p, kind) is None and (not failing or rng.random() < 0.3)
        }
        codes = list(skill.failures()) or [""]
        code = codes[int(rng.integers(len(codes)))] if failing else ""
        return LeafOutcome(kind, code, ports=ports, after_s=after)

    def _port(self, skill: type[Skill], port: str, rng: np.random.Generator) -> object:
        kind: Any = skill.OUTPUT_PORTS[port].data_type
        if kind is tuple:
            element: Any = getattr(getattr(skill, port), "element", None) or object
            items = [self._object(element, rng) for _ in range(int(rng.choice([0, 1, 2, 3], p=[0.1, 0.4, 0.3, 0.2])))]
            return tuple(items)
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
        """Return a new value with its number fields drawn."""
        numbers = {
            f: float(np.round(rng.random(), 2))
            for f, t in getattr(kind, "__annotations__", {}).items()
            if t in (float, "float")
        }
        if kind is object:
            return object()
        if not numbers or not hasattr(kind, "__dataclass_fields__"):
            # Not from the cache: values are compared by identity.
            return port_value.__wrapped__(kind, None)
        return stand_in(kind, **numbers)
