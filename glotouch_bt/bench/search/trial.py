"""One trial of `bench search` as a row: the mission in MuJoCo, or the exploration in the planar simulator.

Travel is the planar path length of the ball from the first sweep to the end of the exploration: sweeps, hops,
retreats and tracing. Travel before it (floor touch, calibration) is `before_m`. Travel after it (touching the tops,
returning the probe) discovers nothing and is not counted.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.bench.planar import FeltSection, Traced, explore, felt_section, planar_world, refine_all
from glotouch_bt.bench.search.scoring import Found, TrueLayout, score
from glotouch_bt.campaign import Row, crashed, launch_trial
from glotouch_bt.mission import load_mission
from glotouch_bt.perception.search import search_policy
from glotouch_bt.report import RunRecord, read_run
from glotouch_bt.robot import Array, BadInput, Pose, World
from glotouch_bt.robot.scene import Mesh, load_folder
from glotouch_bt.runs import RunRequest

SWEEP_NODE, TRACE_NODE, REFINE_NODE = "guarded_sweep", "orbit_probe", "refine_outline"
TOP_NODE = "touch_top"
AGAIN = re.compile(r" \d+$")
"""Number of a node that stands in a tree several times."""
STILL_M = 0.0003
"""Smallest step that counts as travel; a standing arm sways by less."""
EMPTY_ROW: dict[str, Any] = {
    "ended": "", "discovered_m": [], "false_candidates": 0, "candidates": [], "travel_m": 0.0, "before_m": None,
    "contacts": 0,
}  # fmt: skip


def mission_trial(head: Row, request: RunRequest) -> Row:
    """Run the mission and score its record; `head` are the first columns of the row.

    Raises:
        BadInput: The request itself is wrong.
    """
    sections = sections_of(request.mission, request.objects, request.world)
    done = launch_trial(request)
    return EMPTY_ROW | head | {"ended": _ended(done.result)} | score_run(read_run(done.folder), sections)


def failed_trial(head: Row, error: Exception) -> Row:
    """Return the row of a trial that raised or whose process was lost: it discovered nothing."""
    return EMPTY_ROW | head | {"ended": crashed(error)["cause"]}


def recorded_folders(top: Path, conditions: str) -> list[Path]:
    """Return the folders of finished simulated runs below `top` under these conditions, by name.

    Raises:
        BadInput: There is none.
    """
    out = []
    for file in sorted(top.rglob("result.json")):
        try:
            result = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        whole = all((file.parent / name).is_file() for name in ("run.mcap", "truth.json"))
        if whole and isinstance(result, dict) and result.get("conditions") == conditions:
            out.append(file.parent)
    if not out:
        raise BadInput(f"{top}: no recorded run under {conditions!r} conditions with its truth is below this folder")
    return out


def recorded_trial(folder: Path, mission: str, objects: Path | None, world: str | None, policy: str) -> Row:
    """Return the row of a recorded run of any mission that explores.

    Args:
        folder: Folder of the run.
        mission, objects, world: Source of the meshes.
        policy: Name of the policy if the run does not record it.
    """
    record = read_run(folder)
    policy = str((record.run.get("parameters") or {}).get("policy", policy))
    row = EMPTY_ROW | {"simulator": record.run["backend"], "policy": policy, "seed": int(record.run["seed"])}
    row["folder"] = str(folder)
    return row | {"ended": _ended(record.result)} | score_run(record, sections_of(mission, objects, world))


def _ended(result: Any) -> str:
    """Return "success", or the code of the root reason."""
    if result["status"] == "success":
        return "complete"
    chain = result["reason_chain"]
    return str(chain[-1].get("code") or result["status"]) if chain else str(result["status"])


@lru_cache(maxsize=2)
def sections_of(mission: str, objects: Path | None, world: str | None = None) -> dict[str, FeltSection]:
    """Return the probe sections of a mission's objects, by name.

    Raises:
        BadInput: Objects of the world lie on other sides than upright.
    """
    there, meshes = scene(mission, objects, world)
    if there.objects.stance != "upright":
        raise BadInput(f"world {there.name!r}: missions with lying objects are not scored; use --trials 0 --planar N")
    return {m.name: felt_section(m, there.probe) for m in meshes}


@lru_cache(maxsize=2)
def scene(mission: str, objects: Path | None, world: str | None = None) -> tuple[World, Sequence[Mesh]]:
    """Return the mission's world, or another one by name or path, and its meshes.

    Raises:
        BadInput: There is no such mission or world, or a mesh is unusable.
    """
    there = load_mission(mission, {}, objects=objects, world=world).world
    return there, load_folder(there.objects.folder, there.objects.names)


def score_run(record: RunRecord, sections: dict[str, FeltSection]) -> dict[str, Any]:
    """Score the discoveries of a recorded run against its truth.

    A candidate that was forgotten counts as never found. One that is being traced anew counts as found meanwhile, if
    the new outline, which has its index, is right, too. `contact_gap_mm` are the distances of the ball from the true
    probe section where sweeps stopped.

    Raises:
        BadInput: The record has no truth beside it.
    """
    pose_B_K = record.pose_B_K
    if record.truth is None or pose_B_K is None:
        raise BadInput(f"{record.path}: no truth is written beside this record; only a simulation can be scored")
    layout = true_layout(record.truth, pose_B_K, sections)
    way = TipPath.of(record)
    heights = {e.data["candidate"]: float(e.data["height_m"]) for e in record.of_kind("top")}
    states: dict[int, list[tuple[float, Any]]] = {}
    contacts: dict[int, int] = {}
    for e in record.of_kind("candidate", "forgotten"):
        if e.kind == "forgotten":
            for gone in e.data["candidates"]:
                states.pop(gone, None)
                contacts.pop(gone, None)
        elif AGAIN.sub("", e.data["node"]) != TOP_NODE:
            index = int(e.data["candidate"]["index"])
            states.setdefault(index, []).append((way.travel_m(e.stamp_s), e.data["candidate"]))
            if "displaced_m" in e.data:
                contacts[index] = len(e.data["candidate"]["contacts"])
    row = score([_found(*of[-1], heights.get(i), of[:-1]) for i, of in sorted(states.items())], layout)
    row["contacts"] = sum(contacts.values())
    row["contact_gap_mm"] = _gaps(record, layout)
    return row | {"travel_m": way.total_m, "before_m": way.before_m}


def _found(travel_m: float, candidate: Any, height_m: float | None, earlier: Sequence[tuple[float, Any]] = ()) -> Found:
    def centre(of: Any) -> Array:
        return np.array(of["contour"]["centre_K_m"])

    contour = candidate["contour"]
    before = tuple((at_m, centre(state)) for at_m, state in earlier)
    return Found(travel_m, centre(candidate), contour["kind"], float(contour["yaw_rad"]), height_m, before)


def true_layout(truth: Any, pose_B_K: Pose, sections: dict[str, FeltSection]) -> TrueLayout:
    """Return the objects of a truth.json in the container frame given to the robot."""
    to_K = pose_B_K.inverse()

    def planar(objects: Any) -> Array:
        poses = [to_K @ Pose(np.array(o["pose_B_O"]["position_m"]), np.array(o["pose_B_O"]["quat"])) for o in objects]
        return np.array([(p.position_m[0], p.position_m[1], p.yaw_rad) for p in poses]).reshape(-1, 3)

    names = [o["name"] for o in truth["start"]]
    return TrueLayout(tuple(sections[n] for n in names), planar(truth["start"]), planar(truth["end"]))


def _gaps(record: RunRecord, layout: TrueLayout) -> list[float]:
    """Return the gap, mm, between ball and nearest object at the first sweep contact with each object.

    Objects are at their initial poses; later contacts find them pushed.
    """
    out: dict[int, float] = {}
    for e in record.of_kind("contact"):
        contact = e.data["contact"]
        if e.data.get("node") != SWEEP_NODE or abs(contact["approach_K"][2]) > 0.5:
            continue
        tip = np.array(contact["tip_K_m"][:2])
        gaps = []
        for section, (x, y, yaw) in zip(layout.sections, layout.before, strict=True):
            c, s = np.cos(yaw), np.sin(yaw)
            gaps.append(float(section.side((tip - (x, y))[None] @ np.array([[c, -s], [s, c]]))[0]))
        nearest = int(np.argmin(np.abs(gaps)))
        out.setdefault(nearest, round(1e3 * gaps[nearest], 4))
    return list(out.values())


@dataclass(frozen=True)
class TipPath:
    """Planar path of the tip in a record.

    Attributes:
        stamp_s, length_m: (n,) travel since the probe was picked up, at each control cycle.
        begin_s, end_s: Start and end of the exploration.
    """

    stamp_s: Array
    length_m: Array
    begin_s: float
    end_s: float

    @classmethod
    def of(cls, record: RunRecord) -> TipPath:
        """Read the path from a record; empty if nothing was explored."""
        ticks = [t for t in record.ticks if t.node.rsplit("/", 1)[-1] in (SWEEP_NODE, TRACE_NODE)]
        later = [t for t in record.ticks if t.node.rsplit("/", 1)[-1] == REFINE_NODE]
        held = [e.stamp_s for e in record.of_kind("tool") if e.data.get("held")]
        pose_B_K = record.pose_B_K
        if not ticks or not held or pose_B_K is None or "position_B_P" not in record.samples:
            return cls(np.zeros(1), np.zeros(1), np.inf, np.inf)
        stamps = record.samples["stamp_s"]
        use = np.nonzero((stamps >= held[0]) & (stamps <= max(t.stamp_s for t in (*ticks[-1:], *later[-1:]))))[0][::10]
        # the hand keeps pointing down with one yaw, so the tip moves in the plane as the pads' mid-point does
        p = pose_B_K.inverse().apply(record.samples["position_B_P"][use])[:, :2]
        return cls(stamps[use], _travelled(p), ticks[0].stamp_s, ticks[-1].stamp_s)

    def travel_m(self, stamp_s: float) -> float:
        """Return the travel from the start of the exploration to a time, refining included."""
        if not np.isfinite(self.begin_s):
            return 0.0
        return float(np.interp(stamp_s, self.stamp_s, self.length_m)) - self.before_m

    @property
    def total_m(self) -> float:
        """Return the travel of the whole exploration."""
        return self.travel_m(self.end_s)

    @property
    def before_m(self) -> float:
        """Return the travel with the probe in hand before the exploration."""
        return float(np.interp(self.begin_s, self.stamp_s, self.length_m)) if np.isfinite(self.begin_s) else 0.0


def _travelled(places: Array) -> Array:
    """Return the cumulative path length (n,) along places (n, 2), in steps of at least `STILL_M`."""
    out = np.zeros(len(places))
    total, last = 0.0, places[0]
    for k, p in enumerate(places):
        step = float(np.hypot(p[0] - last[0], p[1] - last[1]))
        if step >= STILL_M:
            total, last = total + step, p
        out[k] = total
    return out


def planar_trial(head: Row, mission: str, objects: Path | None, other_world: str | None, budget_m: float | None) -> Row:
    """Run an exploration in the planar simulator; `head` are the first columns of the row."""
    policy, seed = head["policy"], head["seed"]
    world, meshes = scene(mission, objects, other_world)
    planar = planar_world(world, meshes, seed)
    explored = explore(planar, search_policy(policy, seed), len(meshes), budget_m=budget_m)
    layout = TrueLayout(planar.sections, planar.start_poses, planar.poses)
    found = _planar(explored.found)
    row = {"ended": explored.ended, "travel_m": explored.travel_m, "contacts": explored.contacts}
    scored = score(found, layout)
    if len(scored["discovered_m"]) < len(meshes):  # otherwise refining discovers nothing more
        measured = _planar(refine_all(planar, explored, budget_m=budget_m))
        scored = score(found, TrueLayout(planar.sections, planar.start_poses, planar.poses), measured)
    return EMPTY_ROW | head | row | scored


def _planar(traced: Sequence[Traced]) -> list[Found]:
    found = []
    for t in traced:
        contour = t.candidate.contour
        earlier = tuple((e.travel_m, e.candidate.contour.centre_K_m) for e in t.earlier)
        found.append(Found(t.travel_m, contour.centre_K_m, contour.kind, contour.yaw_rad, earlier=earlier))
    return found
