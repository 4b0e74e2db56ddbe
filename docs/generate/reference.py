"""Pages on what a mission may use: nodes, skills, worlds, conditions, faults, findings; and on the record."""

from __future__ import annotations

import inspect
import re
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_origin

import missions
import numpy as np
import yaml
from markdown_text import NOTE, code, codes, fields, prose, table
from mcap.reader import make_reader
from pydantic import BaseModel

from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.faults import CATALOGUE
from glotouch_bt.mission.export import describe_nodes, describe_skill
from glotouch_bt.mission.read import SkillRegistry, WorldFile, shipped
from glotouch_bt.mission.record import Recorder
from glotouch_bt.mission.record.mcap_schemas import CHANNELS as CHANNELS_OF_RECORD
from glotouch_bt.mission.spec import describe_findings
from glotouch_bt.robot import HOLD, FakeRobot, GelImages, RobotFile
from glotouch_bt.robot.definition import LIMITS

RECORD = """# The record of a run: run.mcap

Every run writes one [MCAP](https://mcap.dev) file. It carries Foxglove's schemas and has been read back with
independent MCAP and protobuf readers, but not yet opened in Foxglove itself. All times are the robot's clock in
nanoseconds; log time equals publish time. The file holds no wall-clock time, so the same inputs give the same
bytes. Chunks are compressed with zstd and end every 50 control cycles (0.5 s). The record of a killed process can
be read up to its last chunk.

Frames: B arm base, link1 ... the joints', E flange, P mid-point of the pads, left and right the fingers, K container, S
wrist sensor. Numbers that are not finite are `null` in
JSON. Arrays in events are nested lists, rounded to 1e-9 (large ones to 1e-6); dataclasses are objects of their
fields.

Attachments: `run.json` (mission, seed, conditions, container; also the metadata record `run`) and `result.json`
without its wall times.

`glotouch report RUN` draws a record. In Python, `glotouch_bt.report.read_run(folder)` returns its arrays and
events.
"""
TOPIC_NOTES = {
    "/wrench": "25 Hz; newest sample, force in N and its magnitude, torque in Nm, in S",
    "/pose": "25 Hz; P in B",
    "/tf": "25 Hz; every frame: P and K in B, the links, E, the fingers in P",
    "/joints": "25 Hz; rad and rad/s",
    "/gripper": "25 Hz; as last reported",
    "/tactile/left": "at most 10 Hz; depth map, 32FC1, metres, row 0 nearest the wrist",
    "/tactile/right": "as left",
    "/tree/ticks": "on change; `node` is the path in the tree",
    "/tree/ports": "on write; arrays of more than 64 numbers as {shape, min, max}",
    "/scene": "on change; contacts and outlines, in K",
    "/scene/world": "once; robot and container",
    "/log": "on event; in words, without sweeps and requests",
    "/packed/samples": "every force sample (1 kHz)",
    "/packed/cycles": "every control cycle; the first row precedes the first command",
    "/packed/tactile": "every pair of depth maps",
    "/packed/images": "every pair of gel images, on request; pixels red, green, blue in 0..255",
    "/packed/image_requests": "every cycle whose command requested gel images",
}
PACKED = """## Full-rate data: /packed/*

Schema `glotouch.Packed` (protobuf):

    message Packed {
      int64 start_ns = 1;    // robot clock of the first row
      uint32 rows = 2;
      string layout = 3;     // "name:shape:step:order name:shape:step:order ..."
      bytes data = 4;
    }

`data` holds the columns one after the other. A column of shape `1`, `7` or `35x20` has w numbers in a row and takes
4 * rows * w bytes: for each of the w numbers, four byte planes of `rows` bytes, least significant plane first. To
unpack a column, join the planes to little-endian int32, sum cumulatively along the rows `order` times (modulo 2^32)
and multiply by `step`. The int32 value
-2^31 is NaN. `glotouch_bt.mission.record.mcap_packing.unpack` does this. Stamps are relative to `start_ns`.

A command column is NaN in a cycle that gave no such command. The steps are far below the noise of the sensors. The
runner rounds each observation to them before any skill sees it; this is why a replay repeats a run to the bit.
"""
EVENTS = """## Events: /events/KIND

Each event has `kind` and `data`. Skills write what they found (`contact`, `candidate`, `touchset`, `ranking`,
`plan`, `grasp`, `lift`, ...). The executive writes `failure` (a skill failed; also one that the tree recovers
from), `guard` (supervision), `fault` (injected), `pause`, `paused`, `resumed`, `ending`, `stuck`.
"""


def pages() -> dict[str, str]:
    """Return every page of this module by its path below docs/."""
    made = {
        "missions": missions.page,
        "nodes": nodes,
        "skills": skills,
        "worlds": worlds,
        "robots": robots,
        "conditions": conditions,
        "faults": faults,
        "findings": findings,
        "record": record,
    }
    return {f"reference/{name}.md": NOTE + make().rstrip() + "\n" for name, make in made.items()}


def _own_skills() -> list[dict[str, Any]]:
    """Descriptions of the skills that ship with the project."""
    shelf = SkillRegistry()
    return [describe_skill(n, shelf[n]) for n in sorted(shelf) if shelf[n].__module__.startswith("glotouch_skills.")]


def nodes() -> str:
    """Return the page on node kinds."""
    found = [n for n in describe_nodes() if n["description"]]
    children = {"none": "none", "one": "one, `do:`", "many": "a list"}
    rows = [(f"[`{n['name']}`](#{n['name']})", n["description"], children[n["children"]], n["btcpp"]) for n in found]
    text = ["# Nodes\n", "A mission's tree is built from these nodes and from [skills](skills.md).\n"]
    text.append(table(("node", "result", "children", "BehaviorTree.CPP"), rows))
    for n in found:
        text.append(f"## {n['name']}\n\n{n['description'][0].upper()}{n['description'][1:]}.\n")
        text.append(_parameters(n["settings"], "setting") or "No settings.\n")
    return "\n".join(text)


def _parameters(found: list[dict[str, Any]], title: str) -> str:
    """Return a table of parameters or settings."""
    rows = [(code(p["name"]), p["type"], p["unit"], _default(p), p["range"], p["description"]) for p in found]
    return table((title, "type", "unit", "default", "valid", "meaning"), rows)


def skills() -> str:
    """Return the page on the shipped skills."""
    found = _own_skills()
    first = [(f"[`{s['name']}`](#{s['name']})", prose(s["description"]).split("\n\n")[0].split("\n")[0]) for s in found]
    intro = "Skills of the package `glotouch_skills`. `glotouch skills` also lists those of other installed packages.\n"
    text = ["# Skills\n", intro, table(("skill", "what it does"), first)]
    for s in found:
        text.append(f"## {s['name']}\n\n{prose(s['description'])}\n")
        text.append(_parameters(s["parameters"], "parameter"))
        ports = [
            (code(p["name"]), way, code(p["key"]), p["type"], "yes" if p.get("required") else "", p["description"])
            for way, many in (("in", s["inputs"]), ("out", s["outputs"]))
            for p in many
        ]
        text.append(table(("port", "direction", "key", "type", "required", "meaning"), ports))
        hand = [(code(r), "before", codes(states)) for r, states in s["needs"].items()]
        hand += [(code(r), "after success", code(state)) for r, state in s["leaves"].items()]
        hand += [(code(r), "after failure", codes(states)) for r, states in s["after_failure"].items()]
        text.append(table(("resource", "when", "state"), hand))
        text.append(_failures(s["failures"]))
        uses = f" Uses {codes(s['uses'])} alone." if s["uses"] else ""
        text.append(f"On a pause: `{s['pause']}`.{uses}\n")
    return "\n".join(t for t in text if t)


def _failures(found: Any) -> str:
    """Return the failures of a skill: a mapping of codes to meanings, or rows with an advice."""
    if isinstance(found, dict):
        return table(("failure", "meaning"), ((code(c), m) for c, m in found.items()))
    return table(("failure", "meaning", "advice"), ((code(f["code"]), f["meaning"], f.get("advice")) for f in found))


def _default(p: dict[str, Any]) -> str:
    if p["required"]:
        return "required"
    value = p["default"]
    return code(f"{value:g}" if isinstance(value, float) else "" if value in ({}, ()) else value)


def worlds() -> str:
    """Return the page on worlds."""
    text = [
        "# Worlds\n",
        "A world is what the robot is told: the container, the probe, its holder and a folder of STL files. The true "
        "world of a simulation is drawn from the seed and the [conditions](conditions.md). Positions are in B, the "
        "arm's base frame; "
        "K is the centre of the container's floor.\n",
        "A mission names its world. `run`, `check` and `bench retrieve --world WORLD` take another one: a file, or a "
        "shipped name.\n",
        "```yaml\n" + shipped("worlds")["container_five"].read_text().rstrip() + "\n```\n",
        fields(WorldFile),
    ]
    for name, field in WorldFile.model_fields.items():
        kind = field.annotation
        if inspect.isclass(kind) and issubclass(kind, BaseModel):
            text.append(f"## {name}\n\n{prose(kind.__doc__ or '')}\n\n{fields(kind)}")
    rows = [(code(n), yaml.safe_load(p.read_text()).get("description", "")) for n, p in shipped("worlds").items()]
    return "\n".join([*text, "## Shipped worlds\n", table(("world", "description"), rows)])


def robots() -> str:
    """Return the page on robots' files."""
    text = [
        "# Robots\n",
        "A robot of the simulation is a URDF and a YAML file. The URDF has the arm's kinematics, inertias and limits. "
        "The YAML file has what a URDF cannot say. `--set robot=NAME` takes a shipped robot, `--set robot=FILE.yaml` "
        "one of your own; [Write a backend](../guides/backend.md) shows how to write it.\n",
        table(
            ("shipped", "robot", "source"),
            [(code(n), load_robot(n).name, load_robot(n).source) for n in shipped_robots()],
        ),
        "## The YAML file\n",
        fields(RobotFile),
    ]
    for name, model in sections(RobotFile):
        text.append(f"### {name}\n\n{prose(model.__doc__ or '')}\n\n{fields(model)}")
    limits = [(code(f"limit {name}"), what) for name, what in LIMITS.items()]
    text += [
        "## The URDF\n",
        "Only the chain from `base` to `flange` is read. Its joints must be revolute; joints after the last of them "
        "may be fixed, and their links have no mass. Meshes, transmissions and branches are ignored.\n",
        table(
            ("part", "meaning"),
            [
                (code("joint origin"), "frame of the joint in the link before it; m and rad (roll, pitch, yaw)"),
                (code("joint axis"), "axis of rotation in the joint's frame"),
                *limits,
                (code("link inertial"), "mass in kg, inertia in kg m2 and the frame of both, of every link"),
            ],
        ),
        "## The shipped file iiwa14.yaml\n",
        "```yaml\n" + shipped_robots()["iiwa14"].read_text().rstrip() + "\n```\n",
    ]
    return "\n".join(text)


def sections(model: type[BaseModel], above: str = "") -> list[tuple[str, type[BaseModel]]]:
    """Return every section inside a file's model, with its place."""
    found: list[tuple[str, type[BaseModel]]] = []
    for name, field in model.model_fields.items():
        inside = [field.annotation]
        for kind in inside:
            inside += get_args(kind)
        named = f"{above}{name}" + (".NAME" if get_origin(field.annotation) is dict else "")
        for kind in inside:
            if inspect.isclass(kind) and issubclass(kind, BaseModel):
                found += [(named, kind), *sections(kind, f"{named}.")]
    return found


def conditions() -> str:
    """Return the page on conditions: every field of the shipped profiles side by side."""
    files = shipped("conditions")
    notes = dict(re.findall(r"^(\w+): .*?#\s*(.*)$", files["realistic"].read_text(), re.MULTILINE))
    read = {n: yaml.safe_load(p.read_text()) for n, p in files.items()}
    names = [n for n in ("ideal", "nominal", "harsh", "realistic", "strong") if n in read]
    keys = [k for k in read["realistic"] if k != "name"]
    rows = [(code(k), notes.get(k, ""), *(read[n].get(k, "") for n in names)) for k in keys]
    text = (
        "# Conditions\n\nConditions are the disturbances of a simulated run. `run --conditions NAME` takes a shipped "
        "profile or a YAML file with these keys. `sd` is one standard deviation; `[low, high]` is a uniform range. "
        "Values are drawn per run from the seed. Skills are never told them. A field that a profile leaves out is zero "
        "or the default of `glotouch_bt.robot.Conditions`.\n\n"
        "`--conditions NAME+FIELD=VALUE` changes a field of a profile, and `run --set-condition FIELD=VALUE` does the "
        "same; VALUE is a number, or `LOW,HIGH` for a range. So an axis can be studied alone "
        "(`--conditions nominal --set-condition gel_blur_m=0.0015`) or left out "
        "(`--conditions realistic+following_error_s=0`). The fields from `object_scale` on are axes that have no "
        "effect in ideal, nominal and harsh. `strong` sets them to the ends of their sweeps, all at once. "
        "A run in which such an axis is set, its sensor is used, and not a single bit of the model or of a reading "
        "changes, ends with an error.\n\n"
    )
    return text + table(("field", "unit, meaning, source", *names), rows)


def faults() -> str:
    """Return the page on faults."""
    text = [
        "# Faults\n",
        "`glotouch run MISSION --faults FILE` injects these faults; [Inject a fault](../guides/faults.md) shows how to "
        "write the file. *Recoverable*: a mission can still reach its goal. Faults of the world need a simulation.\n",
    ]
    for channel in dict.fromkeys(k.channel for k in CATALOGUE.values()):
        kinds = [k for k in CATALOGUE.values() if k.channel == channel]
        names = (f"[`{k.name}`](#{k.name})" if k.parameters() else code(k.name) for k in kinds)
        summary = [
            (name, k.summary, k.seen_by, "yes" if k.recoverable else "no") for name, k in zip(names, kinds, strict=True)
        ]
        text.append(f"## {channel}\n\n" + table(("fault", "effect", "should be noticed by", "recoverable"), summary))
        for k in kinds:
            if given := k.parameters():
                rows = [(code(p["name"]), p["unit"], code(p["default"]), p["valid"], p["description"]) for p in given]
                text.append(f"### {k.name}\n\n" + table(("parameter", "unit", "default", "valid", "meaning"), rows))
    return "\n".join(text)


def findings() -> str:
    """Return the page on the findings of `glotouch check`."""
    found = sorted(describe_findings(), key=lambda f: (f["severity"], f["code"]))
    text = ["# Findings of `glotouch check`\n"]
    for severity, meaning in (
        ("error", "`run` refuses a mission with errors."),
        ("warning", "A warning may be intended."),
    ):
        rows = [(code(f["code"]), f["meaning"], f["why"], f["advice"]) for f in found if f["severity"] == severity]
        text.append(f"## {severity.capitalize()}s\n\n{meaning}\n")
        text.append(table(("code", "meaning", "why it matters", "what to do"), rows))
    return "\n".join(text)


def record() -> str:
    """Return the page on the record; topics and columns are read from a record that is written here."""
    robot, command = FakeRobot(), replace(HOLD, tactile=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        recorder = Recorder(path, {"mission": "none"})
        rows, columns = XENSE_GRIPPER.camera.shape if XENSE_GRIPPER.camera else (1, 1)
        pixels = np.zeros((rows, columns, 3), dtype=np.uint8)
        for k in range(50):
            images = GelImages(0.01 * k, pixels, pixels) if k == 0 else None
            recorder.block(replace(robot.cycle(command), images=images), replace(command, images=k == 0))
        recorder.close()
        layouts = {}
        with path.open("rb") as f:
            for _, channel, message in make_reader(f).iter_messages():
                if found := re.search(rb"stamp_s:1:[\w.: -]*", message.data):
                    layouts[channel.topic] = found[0].decode().split()
    topics = [(code(t), s, TOPIC_NOTES[t]) for t, s in CHANNELS_OF_RECORD.items()]
    topics.append((code("/events/KIND"), "glotouch.Event", "on event; see below"))
    text = [RECORD, "## Topics\n", table(("topic", "schema", "rate, content"), topics), EVENTS, PACKED]
    for topic, columns in layouts.items():
        rows = [(code(n), shape, step, order) for n, shape, step, order in (c.split(":") for c in columns)]
        text.append(f"### {topic}\n\n" + table(("column", "shape", "step", "order"), rows))
    return "\n".join(text)
