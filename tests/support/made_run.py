"""A made-up mission, written through the Recorder as a runner would, with numbers the tests know."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.perception.touch.values import Candidate, Contact, Contour, Layer, TouchSequence, TouchSet
from glotouch_bt.robot import HOLD, Command, GripperState, GripperTarget, JointSetpoint, Observation, Pose, TactileFrame
from glotouch_bt.robot.description import RobotDescription

TIP_M = 0.130
POSE_B_K = Pose.planar([0.60, 0.02, -0.20], 0.1)
INTERIOR_M = (0.40, 0.30, 0.08)
N = 10

OBJECTS = (  # name, kind, centre, (long, short), yaw, height
    ("apple", "round", (-0.12, 0.07), (0.062, 0.062), 0.0, 0.058),
    ("train", "box", (0.02, -0.08), (0.084, 0.038), 0.5, 0.045),
    ("truck", "box", (0.12, 0.06), (0.078, 0.042), -0.9, 0.050),
    ("<b>wukong & co</b>", "round", (-0.02, 0.06), (0.048, 0.048), 0.0, 0.071),
    ("nailong", "box", (-0.11, -0.07), (0.060, 0.048), 1.2, 0.066),
)
WANTED = 3


@dataclass
class Made:
    """Contents of a made run, which tests compare with what is read back."""

    folder: Path
    contacts: list[Contact]
    candidates: list[Candidate]
    touchsets: list[TouchSet]
    cycles: int


class Clock:
    """Feeds a Recorder control cycles along straight tip moves, force bumps and closures."""

    def __init__(self, record: Recorder, rng: np.random.Generator) -> None:
        self.record, self.rng, self.t = record, rng, 0
        self.at = np.array([0.5, -0.3, 0.25])
        self.aperture, self.cycles = 0.08, 0

    @property
    def now_s(self) -> float:
        return self.t * 1e-3

    def cycle(self, position: np.ndarray, force: np.ndarray, tactile: TactileFrame | None = None) -> None:
        stamp = (self.t + np.arange(N) + 1) * 1e-3
        self.t += N
        q = np.outer(np.sin(0.1 * stamp), np.arange(1, 8) * 0.1)
        wrench = self.rng.normal(0.0, [0.05] * 3 + [0.003] * 3, (N, 6))
        wrench[:, :3] += force
        quat = np.tile(Pose.pointing_down([0, 0, 0], 0.0).quat, (N, 1))
        jaws = GripperState(float(stamp[-1]), self.aperture, 5.0, False)
        o = Observation(stamp, q, 0 * q, position, quat, wrench, jaws, tactile)
        c = Command(
            JointSetpoint(q[-1], 0 * q[-1], 0 * q[-1], Pose(position[-1])), GripperTarget(self.aperture, 0.1, 10)
        )
        self.record.block(o, c if self.cycles % 2 else HOLD)
        self.cycles += 1

    def line_K(self, to_K: np.ndarray, lift_m: float = TIP_M, speed: float = 0.12) -> None:
        """Move so that what hangs `lift_m` below P comes to `to_K`."""
        goal = POSE_B_K.apply(to_K) + np.array([0, 0, lift_m])
        n = max(2, int(np.linalg.norm(goal - self.at) / speed * 100))
        path = self.at + np.linspace(0, 1, n * N + 1)[1:, None] * (goal - self.at)
        for k in range(n):
            self.cycle(path[N * k : N * (k + 1)], np.zeros((N, 3)))
        self.at = goal

    def bump(self, direction: np.ndarray, peak_N: float) -> None:
        """A contact onset now: force rises over 12 ms, falls over 40 ms."""
        t = np.arange(6 * N)
        size = peak_N * np.minimum(t / 12.0, 1) * np.exp(-np.maximum(t - 12, 0) / 15.0)
        for k in range(6):
            here = np.tile(self.at, (N, 1))
            self.cycle(here, size[N * k : N * (k + 1), None] * direction)


def contour_of(spec: tuple[str, str, tuple[float, float], tuple[float, float], float, float]) -> Contour:
    _, kind, centre, size, yaw, _ = spec
    return Contour(kind, np.array(centre), size, yaw, 0.0, np.zeros(0))  # type: ignore[arg-type]


def depth(rng: np.random.Generator, bow: float, deep_m: float) -> np.ndarray:
    """A gel's print of a bowed surface, 35 x 20, with one dead taxel."""
    y, x = np.mgrid[-1:1:35j, -1:1:20j]
    d = np.clip(deep_m * (1.0 - bow * (x**2 + 0.4 * (y - 0.2) ** 2)), 0.0, None) + rng.normal(0, 2e-5, (35, 20))
    d[3, 4] = np.nan
    return d


def make_run(folder: Path, *, until: str = "end", seed: int = 5, description: RobotDescription | None = None,
             target: str = OBJECTS[WANTED][0]) -> Made:  # fmt: skip
    """Write run.mcap, result.json and truth.json. `until`: opened | sweep | end; `description`: of the robot."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    run = {
        "mission": "retrieve",
        "description": "bring <one> object",
        "backend": "fake",
        "seed": 7,
        "conditions": "nominal",
        "parameters": {"target": target, "expected_objects": 5},
        "container": {"pose_B_K": POSE_B_K, "interior_m": INTERIOR_M},
        "probe": {"grasp_to_tip_m": TIP_M},
        "robot": {"description": description},
    }
    record = Recorder(folder / "run.mcap", run)
    made = Made(folder, [], [], [], 0)
    if until == "opened":
        record.close()
        return made
    clock = Clock(record, rng)
    ticks: dict[str, str] = {}

    def tick(node: str, status: str) -> None:
        record.tick(clock.now_s, [(node, ticks.get(node, "INVALID"), status)])
        ticks[node] = status

    tick("retrieve", "RUNNING")
    tick("retrieve/tool_pickup", "RUNNING")
    clock.line_K(np.array([-0.25, -0.1, 0.1]))
    clock.aperture = 0.016
    record.event("tool", clock.now_s, {"node": "tool_pickup", "held": True, "grasp_to_tip_m": TIP_M})
    record.event("calibration", clock.now_s, {"node": "tool_calibrate", "compliance_P_m_N": [0.00163, 0.00073]})
    for text in ("an older value", "compliance <1.63>, 0.73 mm/N"):
        record.event("result", clock.now_s, {"node": "tool_calibrate", "key": "tool", "text": text})
    rows = [[1, "wall <x>", 0.0113], [2, "wall y", -0.25]]
    head = {"title": "Touches & walls", "text": "two <walls>", "head": ["touch", "wall", "mm"], "rows": rows}
    record.event("report", clock.now_s, {"node": "tool_calibrate", **head})
    tick("retrieve/tool_pickup", "SUCCESS")
    tick("retrieve/explore", "RUNNING")
    z = 0.030
    for index, spec in enumerate(OBJECTS):
        tick("retrieve/explore/guarded_sweep", "RUNNING")
        outline, centre = contour_of(spec), np.array(spec[2])
        contacts: list[Contact] = []
        bearings = np.deg2rad([200, 250, 300, 345, 40, 90, 140])
        clock.line_K(np.array([*(centre - np.array([0, 0.06])), z + 0.06]))
        for k, b in enumerate(bearings):
            away = np.array([np.cos(b), np.sin(b)])
            far = centre + away * (outline.radius_m + 0.022)
            touch = centre + away * (edge_distance(outline, b) + 0.006)
            clock.line_K(np.array([*far, z]))
            clock.line_K(np.array([*touch, z]), speed=0.04)
            clock.bump(np.array([*away, 0.1]), 2.0 + 0.4 * k)
            contact = Contact(
                stamp_s=clock.now_s - 0.06,
                tip_K_m=np.array([*touch, z]),
                approach_K=np.array([*-away, 0.0]),
                reaction_K=np.array([*away, 0.0]),
                point_K_m=touch - 0.006 * away + rng.normal(0, 4e-4, 2),
                force_N=1.2 + 0.1 * k,
            )
            contacts.append(contact)
            record.event("contact", clock.now_s, {"node": "orbit_probe", "contact": contact, "seq": k})
            clock.line_K(np.array([*far, z]))
            if k == 0:
                tick("retrieve/explore/guarded_sweep", "SUCCESS")
                tick("retrieve/explore/orbit_probe", "RUNNING")
                if until == "sweep":
                    made.contacts, made.cycles = contacts, clock.cycles
                    result = {
                        "mission": "retrieve",
                        "status": "aborted",
                        "reason_chain": ["interrupted by <user> & co"],
                    }
                    record.close(result)
                    (folder / "result.json").write_text(json.dumps(result))
                    return made
        fitted = replace(outline, centre_K_m=centre + rng.normal(0, 8e-4, 2), rms_m=0.00043)
        candidate = Candidate(index, fitted, spec[5] + 0.0006, 0.93 - 0.05 * index, tuple(contacts))
        record.event("candidate", clock.now_s, {"node": "orbit_probe", "candidate": candidate})
        made.candidates.append(candidate)
        made.contacts += contacts
        tick("retrieve/explore/orbit_probe", "SUCCESS")
    tick("retrieve/explore", "SUCCESS")
    tick("retrieve/tool_return", "RUNNING")
    clock.line_K(np.array([-0.25, -0.1, 0.1]))
    record.event("tool", clock.now_s, {"node": "tool_return", "held": False})
    record.event("note", clock.now_s, {"node": "tool_return", "text": "probe stowed <safely>"})
    tick("retrieve/tool_return", "SUCCESS")
    tick("retrieve/squeeze_all", "RUNNING")
    for candidate in made.candidates:
        tick("retrieve/squeeze_all/squeeze", "RUNNING")
        made.touchsets.append(squeeze(clock, candidate, rng))
        record.event("touchset", clock.now_s, {"node": "squeeze", "touchset": made.touchsets[-1], "refusals": []})
        record.port(clock.now_s, "touchset", made.touchsets[-1])
        tick("retrieve/squeeze_all/squeeze", "SUCCESS" if candidate.index != 1 else "FAILURE")
    tick("retrieve/squeeze_all", "SUCCESS")
    record.event("ranking", clock.now_s, {"node": "match", "target": OBJECTS[WANTED][0], "ranking": ranking(made)})
    tick("retrieve/match", "SUCCESS")
    tick("retrieve/grasp", "RUNNING")
    clock.line_K(np.array([*made.candidates[WANTED].contour.centre_K_m, 0.035]), lift_m=0.0)
    clock.aperture = 0.046
    clock.bump(np.array([0.0, 0.0, 1.0]), 7.5)
    record.event("grasp", clock.now_s, {"node": "grasp", "aperture_m": 0.0461, "expected_m": 0.0458, "force_N": 24.0})
    tick("retrieve/grasp", "SUCCESS")
    tick("retrieve/lift", "RUNNING")
    clock.line_K(np.array([*made.candidates[WANTED].contour.centre_K_m, 0.18]), lift_m=0.0)
    tick("retrieve/lift", "SUCCESS")
    tick("retrieve", "SUCCESS")
    result = {
        "mission": "retrieve",
        "backend": "fake",
        "seed": 7,
        "conditions": "nominal",
        "status": "success",
        "reason_chain": [],
        "target": OBJECTS[WANTED][0],
        "retrieved": True,
        "correct": True,
        "sim_time_s": clock.now_s,
        "wall_time_s": 9.75,
        "probe_path_m": 6.283,
        "peak_force_N": 12.34,
        "true_peak_force_N": 12.34,
        "sensed_peak_force_N": 11.87,
        "versions": {"glotouch": "0.1"},
    }
    record.close(result)
    made.cycles = clock.cycles
    (folder / "result.json").write_text(json.dumps(result))
    (folder / "truth.json").write_text(json.dumps(truth()))
    return made


def edge_distance(outline: Contour, bearing: float) -> float:
    """Distance of a contour's edge from its centre in a direction of K."""
    if outline.kind == "round":
        return outline.size_m[0] / 2
    a = bearing - outline.yaw_rad
    half = np.array(outline.size_m) / 2
    return float(np.min(half / np.maximum(np.abs([np.cos(a), np.sin(a)]), 1e-9)))


def squeeze(clock: Clock, candidate: Candidate, rng: np.random.Generator) -> TouchSet:
    centre, contour = candidate.contour.centre_K_m, candidate.contour
    sequences = []
    for s in range(3):
        yaw = contour.yaw_rad + (s * np.pi / 3 if contour.kind == "round" else 0.0)
        shift = 0.0 if contour.kind == "round" else 0.012 * (s - 1)
        position = centre + shift * np.array([np.cos(yaw), np.sin(yaw)])
        layers = []
        for k in range(4):
            height = 0.018 + 0.010 * k
            clock.aperture = 0.08
            clock.line_K(np.array([*position, height]), lift_m=0.0, speed=0.25)
            clock.aperture = contour.size_m[1] - 0.001 * k + rng.normal(0, 1e-4)
            left, right = depth(rng, 0.5 + 0.3 * s, 8e-4 - 1e-4 * k), depth(rng, 0.9, 6e-4)
            for j in range(8):
                frame = TactileFrame(clock.now_s, left, right) if j % 2 else None
                clock.cycle(np.tile(clock.at, (N, 1)), np.zeros((N, 3)), frame)
            layers.append(Layer(height, clock.aperture, position, yaw, left, right, 8.0 + 0.1 * k, stable=k != 3))
        sequences.append(TouchSequence(position, yaw, tuple(layers)))
    return TouchSet(candidate, tuple(sequences))


def ranking(made: Made) -> dict[str, object]:
    """As recognition's Ranking, recorded."""
    losses = {0: 1.312, 1: 2.4, 2: 1.957, 3: 0.4325, 4: 0.911}
    matches = []
    for index in sorted(losses, key=lambda i: losses[i]):
        share = np.array([0.45, 0.25, 0.15, 0.10, 0.05]) * losses[index]
        terms = dict(zip(("width", "image", "depth", "height", "contour"), share.tolist(), strict=True))
        centre = made.candidates[index].contour.centre_K_m
        pose = (float(centre[0]), float(centre[1]), 0.7)
        matches.append(
            {"index": index, "loss": losses[index], "terms": terms, "pose_K_O": pose, "evidence": 8.25 - index}
        )
    return {
        "matches": matches,
        "margin": 0.911 - 0.4325,
        "accepted": True,
        "reasons": [],
        "gates": {"margin": 0.05, "loss": 1.5, "evidence": 3.0},
    }


def truth() -> dict[str, list[dict[str, object]]]:
    ends: dict[str, list[dict[str, object]]] = {"start": [], "end": []}
    for i, spec in enumerate(OBJECTS):
        start = contour_of(spec).outline_K_m(24)
        end = start + (np.array([0.009, -0.004]) if i == 1 else 0.0)
        for when, p in (("start", start), ("end", end)):
            in_B = POSE_B_K.apply(np.column_stack([p, 0 * p[:, 0]]))[:, :2].tolist()
            ends[when].append({"name": spec[0], "outline_B_m": in_B, "pose": None})
    return ends
