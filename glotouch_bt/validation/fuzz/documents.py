"""Generate random missions and fault plans from their grammar; most are valid, or nearly."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, TypeVar, get_args, get_origin

import numpy as np
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from glotouch_bt.faults import CATALOGUE, Repeat, When
from glotouch_bt.mission.read import SkillRegistry, read_yaml, shipped, shipped_root
from glotouch_bt.mission.spec import plain
from glotouch_bt.skill import Skill

Document = dict[str, Any]
T = TypeVar("T")
MAX_DEPTH = 5
PASSIVE = ("process",)
"""Channels of faults that stop this process; such plans are checked but not run."""


@dataclass
class Grown:
    """A tree under construction.

    Attributes:
        keys: Keys written so far, with the type of their value.
        hand: State of the hand.
    """

    keys: dict[str, Any]
    hand: str = "empty"


@lru_cache(maxsize=1)
def skills() -> Mapping[str, type[Skill]]:
    """Return every installed skill that can be imported."""
    registry = SkillRegistry()
    return {name: registry[name] for name in registry}


@lru_cache(maxsize=1)
def shipped_documents() -> tuple[Document, ...]:
    """Return the shipped missions as plain data."""
    return tuple(plain(read_yaml(path)) for path in shipped("").values())


@lru_cache(maxsize=1)
def shipped_plans() -> tuple[Document, ...]:
    """Return the shipped fault plans as plain data."""
    return tuple(plain(read_yaml(path)) for path in shipped("faults").values())


def grow_mission(rng: np.random.Generator) -> Document:
    """Return a random or shipped mission."""
    if rng.random() < 0.15:
        return deepcopy(pick(rng, shipped_documents()))
    worlds = [f"worlds/{p.name}" for p in sorted((shipped_root() / "worlds").glob("*.yaml"))]
    grown = Grown({})
    document: Document = {"mission": pick(rng, ("m", "fuzz_1", "Ünïcode", "a-b")), "world": pick(rng, worlds)}
    if rng.random() < 0.3:
        document["timeout_s"] = pick(rng, (1, 0.5, 3600, 86400))
    if rng.random() < 0.3:
        document["description"] = "grown at random"
    if rng.random() < 0.4:
        document["parameters"] = {"n": {"type": "int", "default": int(rng.integers(1, 9)), "range": [1, 20]}}
    document["tree"] = _many(rng, grown, 0, "n" in document.get("parameters", {}))
    return document


def grow_plan(rng: np.random.Generator) -> Document:
    """Return a random or shipped fault plan."""
    if shipped_plans() and rng.random() < 0.1:
        return deepcopy(pick(rng, shipped_plans()))
    faults = [_fault(rng) for _ in range(int(rng.integers(1, 6)))]
    document: Document = {"faults": "fuzz", "plan": faults}
    if rng.random() < 0.5:
        document["seed"] = int(rng.integers(0, 2**32))
    return document


def pick(rng: np.random.Generator, options: Sequence[T]) -> T:
    """Pick one of the options."""
    return options[int(rng.integers(len(options)))]


def _many(rng: np.random.Generator, grown: Grown, depth: int, parameter: bool) -> list[Any]:
    return [_node(rng, grown, depth, parameter) for _ in range(int(rng.integers(1, 5 - depth // 2)))]


def _node(rng: np.random.Generator, grown: Grown, depth: int, parameter: bool) -> Any:
    kinds = ["skill"] * 6
    if depth < MAX_DEPTH:
        kinds += ["sequence", "selector", "parallel", "retry", "timeout", "repeat", "for_each", "invert", "succeed",
                  "fail", "condition", "condition"]  # fmt: skip
    kind = pick(rng, kinds)
    if kind == "skill":
        return _skill(rng, grown, parameter)
    if kind == "condition":
        return {"condition": _condition(rng, grown)}
    if kind in ("sequence", "selector", "parallel"):
        below: Any = _many(rng, grown, depth + 1, parameter)
        if kind == "parallel" and rng.random() < 0.5:
            below = {"policy": pick(rng, ("all", "one")), "do": below}
        elif rng.random() < 0.3:
            below = {"name": pick(rng, ("find one", "x", "naïve", "a/b")), "do": below}
        return {kind: below}
    child = _node(rng, grown, depth + 1, parameter)
    settings = _settings(kind, rng, grown)
    return {kind: child if not settings and rng.random() < 0.5 else {**settings, "do": child}}


def _settings(kind: str, rng: np.random.Generator, grown: Grown) -> Document:
    if kind == "retry":
        return {"attempts": int(rng.integers(1, 5))}
    if kind == "timeout":
        return {"seconds": pick(rng, (0.05, 1, "30 s", "500 ms", 2.5))}
    if kind == "repeat":
        if rng.random() < 0.5:
            return {"times": int(rng.integers(1, 5))}
        flags = [k for k, t in grown.keys.items() if t is bool]
        until = pick(rng, flags) if flags and rng.random() < 0.6 else _condition(rng, grown)
        return {"until": until, "limit": int(rng.integers(1, 9))}
    if kind == "for_each":
        tuples = [k for k, t in grown.keys.items() if t is tuple] or ["candidates"]
        return {"items": pick(rng, tuples), "item": pick(rng, ("candidate", "one")),
                "on_failure": pick(rng, ("stop", "continue"))}  # fmt: skip
    return {}


def _condition(rng: np.random.Generator, grown: Grown) -> Document:
    port = pick(rng, [*grown.keys, "found"])
    compare: tuple[Document, ...] = ({"is_set": True}, {"is_set": False})
    if grown.keys.get(port) is bool:
        compare = ({"equals": True}, {"equals": False})
    elif grown.keys.get(port) in (int, float):
        compare = ({"at_least": int(rng.integers(0, 4))}, {"at_most": float(rng.random())}, {"equals": 1})
    return {"port": port, **pick(rng, compare)}


def _skill(rng: np.random.Generator, grown: Grown, parameter: bool) -> Any:
    """Pick a skill, usually one whose inputs and preconditions are met."""
    names = list(skills())
    fitting = [n for n in names if _fits(skills()[n], grown)]
    name = pick(rng, fitting if fitting and rng.random() < 0.95 else names)
    skill = skills()[name]
    for port, key in skill.default_keys().items():
        if port in skill.OUTPUT_PORTS:
            grown.keys[key] = skill.OUTPUT_PORTS[port].data_type
    grown.hand = skill.POSTCONDITIONS.get("hand", grown.hand)
    body = _values(skill.Params, rng, lambda: rng.random() < 0.15)
    if parameter and "expected_objects" in skill.Params.model_fields:
        body["expected_objects"] = "$n"
    if not body and rng.random() < 0.6:
        return name
    return {name: body or None}


def _fits(skill: type[Skill], grown: Grown) -> bool:
    keys = skill.default_keys()
    needed = [keys[p] for p, info in skill.INPUT_PORTS.items() if info.required]
    return all(k in grown.keys for k in needed) and grown.hand in skill.PRECONDITIONS.get("hand", {grown.hand})


def _values(model: type[BaseModel], rng: np.random.Generator, wanted: Callable[[], bool]) -> Document:
    """Draw values for all required and some optional fields."""
    made: Document = {}
    for name, field in model.model_fields.items():
        if field.is_required() or wanted():
            made[name] = _value(field, rng)
    return made


def _value(field: Any, rng: np.random.Generator) -> Any:
    kind: Any = field.annotation
    options = [a for a in get_args(kind) if a is not type(None)] if get_origin(kind) is not Literal else []
    if options and get_origin(kind) not in (tuple, list, dict):
        kind = options[0]
    if get_origin(kind) is Literal:
        return pick(rng, get_args(kind))
    low, high = _range(field)
    if kind is bool:
        return bool(rng.random() < 0.5)
    if kind is int:
        return int(rng.integers(int(np.ceil(low)), int(np.floor(high)) + 1))
    if kind is float:
        return float(np.round(rng.uniform(low, high), 4))
    if kind is str:
        return pick(rng, ("nobody", "squeeze", "*", ""))
    if get_origin(kind) is tuple:
        return [float(np.round(rng.normal(), 3)) for _ in range(3)]
    return None if field.default is PydanticUndefined else field.default


def _range(field: Any) -> tuple[float, float]:
    low = max([float(getattr(m, w)) for m in field.metadata for w in ("ge", "gt") if hasattr(m, w)], default=0.0)
    high = min([float(getattr(m, w)) for m in field.metadata for w in ("le", "lt") if hasattr(m, w)], default=low + 9.0)
    return low, min(max(high, low), low + 1e6)


def _fault(rng: np.random.Generator) -> Document:
    kind = pick(rng, list(CATALOGUE.values()))
    made: Document = {"fault": kind.name}
    given = _values(kind.effect.Params, rng, lambda: rng.random() < 0.4)
    if given:
        made["with"] = {k: v for k, v in given.items() if v is not None}
    if rng.random() < 0.7:
        when = {k: v for k, v in _values(When, rng, lambda: rng.random() < 0.2).items() if v is not None}
        made["when"] = when | ({"node": pick(rng, ("*", "tool_pickup", "m/*"))} if rng.random() < 0.4 else {})
    if rng.random() < 0.7:
        made["for"] = pick(rng, ("ever", "2 s", "500 ms", {"cycles": int(rng.integers(1, 50))}, 0.3, "node"))
    if rng.random() < 0.2:
        made["repeat"] = _values(Repeat, rng, lambda: True)
    return made
