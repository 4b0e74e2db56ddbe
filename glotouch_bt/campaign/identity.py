"""Identity of a trial: code, versions, settings, and digests of mission, world, objects and conditions."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from glotouch_bt import plugins
from glotouch_bt.escaped_text import json_text
from glotouch_bt.faults import FaultPlan, read_plan
from glotouch_bt.mission import load_mission, split_settings
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import to_json
from glotouch_bt.robot import load_backend
from glotouch_bt.robot.scene import stl_files
from glotouch_bt.runs import RunRequest, installed_versions, robot_identity

OURS = ("glotouch_bt", "glotouch_missions")
"""Packages that every result depends on."""
GROUPS = ("glotouch_bt.backends", "glotouch_bt.skills", "glotouch_bt.resume_check", plugins.MATCHERS, plugins.POLICIES)
"""Entry points of further packages."""
SOURCES = (".py", ".yaml", ".urdf")


@cache
def code_versions() -> dict[str, str]:
    """Return the digest of the source files of each package that takes part in a run, by its name."""
    others = {point.module.partition(".")[0] for group in GROUPS for point in plugins.plugins(group).values()}
    return {name: _source_digest(name) for name in sorted({*OURS, *others})}


def _source_digest(package: str) -> str:
    spec = find_spec(package)
    found = hashlib.sha256()
    if spec is not None and spec.submodule_search_locations is None and spec.origin is not None:  # a single file
        found.update(Path(spec.origin).read_bytes())
    for top in map(Path, (spec and spec.submodule_search_locations) or ()):
        for path in sorted(p for p in top.rglob("*") if p.suffix in SOURCES):
            found.update(str(path.relative_to(top)).encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()[:16]


@cache
def _versions() -> dict[str, str]:
    return installed_versions()


def described_code() -> dict[str, Any]:
    """Return the code that results depend on: our source, and the versions of the packages it uses."""
    return {"code": code_versions(), "versions": _versions()}


def described_request(request: RunRequest) -> dict[str, Any]:
    """Return all that the result of a run depends on, as JSON data; files by the digest of their content."""
    settings = tuple(sorted(request.settings.items()))
    return {
        "mission": request.mission,
        "backend": request.backend,
        "seed": request.seed,
        "settings": dict(settings),
        "conditions": request.conditions,
        "faults": _described_plan(request),
        "content": _content(
            request.mission,
            settings,
            request.objects,
            request.world,
            request.conditions,
            request.allow_paths,
            request.backend,
        ),
        **described_code(),
    }


def plain(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return data as it is read back from JSON."""
    found: dict[str, Any] = json.loads(json_text(data, default=str))
    return found


@lru_cache(maxsize=256)
def _content(
    mission: str,
    settings: tuple[tuple[str, str], ...],
    objects: Path | None,
    other_world: str | None,
    conditions: str,
    allow_paths: tuple[Path, ...],
    backend: str,
) -> dict[str, str]:
    """Return the digests of the mission with its world, of each object, of the conditions, and of the robot."""
    loaded = load_mission(mission, dict(settings), objects=objects, world=other_world, allow_paths=allow_paths)
    chosen = loaded.world.objects
    world = replace(loaded.world, objects=replace(chosen, folder=Path()))
    parts: dict[str, Any] = {
        "mission": {k: v for k, v in loaded.document.items() if k != "world"},
        "world": to_json(world),
    }
    found = {name: digest(json.dumps(part, sort_keys=True).encode()) for name, part in parts.items()}
    files = stl_files(chosen.folder)
    robot = load_backend(backend).describe(split_settings(loaded, dict(settings)))
    return (
        found
        | ({} if robot is None else {"robot": robot_identity(robot)["digest"]})
        | {"conditions": conditions_digest(conditions)}
        | {f"object {n}": digest(files[n].read_bytes()) for n in chosen.names or files}
    )


def conditions_digest(conditions: str) -> str:
    """Return the digest of the values of conditions."""
    return digest(json.dumps(asdict(load_conditions(conditions)), sort_keys=True).encode())


def folder_digests(objects: Path | None) -> dict[str, str]:
    """Return the digest of each STL file of a folder; none for the shipped objects, which the missions name."""
    return {} if objects is None else {name: digest(path.read_bytes()) for name, path in stl_files(objects).items()}


def digest(data: bytes) -> str:
    """Return the first 16 digits of the SHA-256 digest."""
    return hashlib.sha256(data).hexdigest()[:16]


def _described_plan(request: RunRequest) -> Any:
    plan = request.faults
    if plan is None:
        return None
    if not isinstance(plan, FaultPlan):
        plan = read_plan(plan)
    return {"seed": plan.seed, "faults": [{"fault": f.kind.name, **f.requested()} for f in plan.faults]}


def difference(there: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """Return the keys in which two descriptions differ, with both values, in words."""
    words = []
    for path, one, two in changes(there, asked):
        within = "".join("content of " if key == "content" else f"{key}: " for key in path[:-1])
        words.append(f"{within}{path[-1]} {_short(one)}, now {_short(two)}")
    return "; ".join(words)


def changes(
    there: Mapping[str, Any], asked: Mapping[str, Any], path: tuple[str, ...] = ()
) -> list[tuple[tuple[str, ...], Any, Any]]:
    """Return (path of keys, value there, value asked) of all that differs between two nested descriptions."""
    found = []
    for key in sorted({*there, *asked}):
        one, two = there.get(key), asked.get(key)
        if isinstance(one, dict) and isinstance(two, dict):
            found += changes(one, two, (*path, key))
        elif one != two:
            found.append(((*path, key), one, two))
    return found


def _short(value: object) -> str:
    text = "none" if value is None else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
