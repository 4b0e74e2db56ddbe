"""Write the record of a run: everything sensed, commanded, ticked and decided, in one MCAP file (Foxglove schemas).

A control cycle costs two list appends; every `batch_cycles` cycles the pending ones are encoded and flushed, so the
file of a killed process is readable up to its last batch. Channels, schemas and packing: docs/reference/record.md.

Times are the robot clock (log time = publish time). No wall clock enters: the same inputs give the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from mcap.writer import CompressionType, Writer

from glotouch_bt.mission.record import mcap_plots as plots
from glotouch_bt.mission.record.event_words import HIDDEN_EVENTS, event_tone, event_words
from glotouch_bt.mission.record.mcap_chunks import RecordChunk
from glotouch_bt.mission.record.mcap_json import Json, dumps, dumps_plain, to_json
from glotouch_bt.mission.record.mcap_packing import Column, pack
from glotouch_bt.mission.record.mcap_robot import LinkFrames, robot_shapes
from glotouch_bt.mission.record.mcap_scene import event_scene, registered_container, world_scene
from glotouch_bt.mission.record.mcap_schemas import EVENT_PREFIX, schema_of
from glotouch_bt.mission.record.rounding import (
    APERTURE_M,
    DEPTH_M,
    FORCE_N,
    JOINT_RAD,
    JOINT_RAD_S,
    POSITION_M,
    QUATERNION,
    SPEED_M_S,
    STAMP_S,
    TORQUE_NM,
)
from glotouch_bt.robot import BadInput, Command, GlotouchError, Observation, RobotDescription
from glotouch_bt.untrusted import create_file
from glotouch_bt.version import __version__

RUN_ATTACHMENT = "run.json"
RESULT_ATTACHMENT = "result.json"
PLOT_EVERY_CYCLES = 4
"""Control cycles from one plotted sample to the next: 25 Hz. The packed channels hold every sample."""
IMAGE_EVERY_S = 0.1
LOG_LEVELS = {"": 2, "good": 2, "warn": 3, "bad": 4}
"""Levels of foxglove.Log: 2 info, 3 warning, 4 error."""


class Recorder:
    """Writes run.mcap, and is the `Journal` of the skills. Use as a context manager, or call `close` in a finally.

    Arrays given to `block` are held by reference until the next flush: they must not be written to afterwards.

    Args:
        path: The file; its folder must exist.
        run: Description of the run (mission, seed, conditions, pose_B_K, container, probe, ...); any value
            `mcap_json.to_json` takes. Stored as the attachment run.json and as the metadata record "run".
        batch_cycles: Control cycles encoded at a time. A killed process loses at most these. The encoding cycle lasts
            longer, by 1.6 ms at 50 and by 18 ms at 500, which a paced arm notices.

    Raises:
        BadInput: The file cannot be written.
    """

    def __init__(self, path: Path, run: Mapping[str, object], *, batch_cycles: int = 50) -> None:
        self.path = path
        self._batch = batch_cycles
        self._observations: list[Observation] = []
        self._commands: list[Command] = []
        self._pending: list[tuple[int, int, bytes]] = []  # log time ns, channel id, message
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._sequence: dict[int, int] = {}
        self._cycles = 0
        self._next_image_ns = 0
        self._closed = False
        try:
            self._file = create_file(path)
        except OSError as e:
            raise BadInput(f"{path}: the record cannot be written ({e.strerror})") from e
        self._writer = Writer(self._file, compression=CompressionType.ZSTD, chunk_size=4 << 20)
        self._writer.start(profile="", library=f"glotouch-bt {__version__}")
        plain = to_json(dict(run))
        assert isinstance(plain, dict)
        self._writer.add_attachment(0, 0, RUN_ATTACHMENT, "application/json", dumps(plain))
        flat = {k: v if isinstance(v, str) else dumps(v).decode() for k, v in plain.items()}
        self._writer.add_metadata("run", flat)
        robot: Any = run.get("robot")
        described = robot.get("description") if isinstance(robot, Mapping) else None
        description = described if isinstance(described, RobotDescription) else None
        container = registered_container(plain)
        self._frames = LinkFrames(description, {} if container is None else {"K": container})
        for topic, message in world_scene(plain, () if description is None else robot_shapes(description)):
            self._put(0, topic, message)
        self._file.flush()

    def block(self, observation: Observation, command: Command) -> None:
        """Record one control cycle: the sensed block and the command."""
        self._observations.append(observation)
        self._commands.append(command)
        if len(self._observations) >= self._batch:
            self._flush()

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Record nodes whose status changed: (path in the tree, old status, new status)."""
        for node, old, new in changes:
            self._message(stamp_s, "/tree/ticks", {"node": node, "old": _status(old), "new": _status(new)})

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Record an event of a skill, on the channel /events/<kind>."""
        plain = to_json(data)
        self._message(stamp_s, EVENT_PREFIX + kind, {"kind": kind, "data": plain})
        if kind not in HIDDEN_EVENTS and isinstance(plain, dict):
            level = LOG_LEVELS[event_tone(kind)]
            said: dict[str, Json] = {
                "level": level,
                "message": f"{kind}: {event_words(kind, plain)}",
                "name": str(plain.get("node", "")),
            }
            self._message(stamp_s, "/log", {**said, "file": "", "line": 0})
        for topic, message in event_scene(kind, _ns(stamp_s), plain):
            self._put(_ns(stamp_s), topic, message)

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Record a blackboard write; large arrays are summarised (the events hold them in full)."""
        self._message(stamp_s, "/tree/ports", {"key": key, "value": to_json(value, summarise=True)})

    def flush(self) -> int:
        """Write everything pending; return the length of the file, which is readable up to there."""
        self._flush()
        self._file.flush()
        return self._file.tell()

    def state(self) -> dict[str, int]:
        """Return what a record that continues from here needs to write the same bytes as this one."""
        return {"cycles": self._cycles, "next_image_ns": self._next_image_ns}

    def continue_from(self, chunks: Iterable[RecordChunk], state: Mapping[str, int]) -> None:
        """Start with the content of another record of the same run.

        Args:
            chunks: Its chunks.
            state: Its `state` after them.
        """
        self._pending.clear()
        for chunk in chunks:
            for topic in chunk.topics:
                self._channel(topic)
            self._pending.extend((ns, self._channel(topic), message) for ns, topic, message in chunk.messages)
            self._flush()
        self._cycles, self._next_image_ns = state["cycles"], state["next_image_ns"]

    def close(self, result: Mapping[str, object] | None = None) -> None:
        """Write everything pending, the result (without its wall times) and the index; idempotent."""
        if self._closed:
            return
        try:
            self._flush()
            if result is not None:
                kept = {k: v for k, v in result.items() if not k.startswith("wall_")}
                self._writer.add_attachment(0, 0, RESULT_ATTACHMENT, "application/json", dumps(kept))
            self._writer.finish()
            self._file.flush()
        except OSError as e:
            raise GlotouchError(f"{self.path}: the record could not be finished ({e.strerror})") from e
        finally:
            self._closed = True
            with suppress(OSError):  # the refused bytes are refused again
                self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _message(self, stamp_s: float, topic: str, body: dict[str, Json]) -> None:
        sec, nsec = divmod(_ns(stamp_s), 10**9)
        self._put(_ns(stamp_s), topic, dumps_plain({"timestamp": {"sec": sec, "nsec": nsec}, **body}))

    def _put(self, log_ns: int, topic: str, message: bytes) -> None:
        self._pending.append((max(log_ns, 0), self._channel(topic), message))  # MCAP times are unsigned

    def _channel(self, topic: str) -> int:
        if self._closed:
            raise GlotouchError(f"{self.path}: the record is closed; nothing more can be written")
        if topic not in self._channels:
            schema = schema_of(topic)
            if schema.name not in self._schemas:
                number = self._writer.register_schema(schema.name, schema.encoding, schema.data)
                self._schemas[schema.name] = number
            self._channels[topic] = self._writer.register_channel(
                topic, schema.message_encoding, self._schemas[schema.name]
            )
        return self._channels[topic]

    def _flush(self) -> None:
        """Encode the pending cycles, write all pending messages in the order of time, end the chunk."""
        observations, commands = self._observations, self._commands
        self._observations, self._commands = [], []
        if observations:
            self._encode_samples(observations)
            self._encode_cycles(observations, commands)
            self._encode_tactile(observations)
            self._encode_images(observations, commands)
            self._cycles += len(observations)
        pending, self._pending = self._pending, []
        pending.sort(key=lambda m: m[0])  # stable: equal stamps stay in the order of writing
        sequence, add = self._sequence, self._writer.add_message
        try:
            for log_ns, channel, message in pending:
                number = sequence.get(channel, 0)
                sequence[channel] = number + 1
                add(channel, log_ns, message, log_ns, number)
            self._writer.flush()
        except OSError as e:
            raise GlotouchError(f"{self.path}: the record could not be written ({e.strerror})") from e

    def _put_rows(self, topic: str, stamps_ns: plots.Stamps, messages: list[bytes]) -> None:
        channel = self._channel(topic)
        log_ns = np.maximum(stamps_ns, 0).tolist()  # MCAP times are unsigned
        self._pending.extend(zip(log_ns, [channel] * len(messages), messages, strict=True))

    def _encode_samples(self, observations: list[Observation]) -> None:
        """Write the full-rate samples, and the newest sample of every fourth cycle as plots."""
        stamp_s = np.concatenate([o.stamp_s for o in observations])
        q = np.concatenate([o.q for o in observations])
        dq = np.concatenate([o.dq for o in observations])
        position = np.concatenate([o.position_B_P for o in observations])
        quat = np.concatenate([o.quat_B_P for o in observations])
        wrench = np.concatenate([o.wrench_S for o in observations])
        start_ns = _ns(stamp_s[0])
        dof = (q.shape[1],)
        columns = (
            Column("stamp_s", (), STAMP_S, 2),
            Column("q", dof, JOINT_RAD, 2),
            Column("dq", dof, JOINT_RAD_S, 1),
            Column("position_B_P", (3,), POSITION_M, 2),
            Column("quat_B_P", (4,), QUATERNION, 2),
            Column("force_S_N", (3,), FORCE_N, 0),
            Column("torque_S_Nm", (3,), TORQUE_NM, 0),
        )
        values = (stamp_s - start_ns * 1e-9, q, dq, position, quat, wrench[:, :3], wrench[:, 3:])
        self._put(start_ns, "/packed/samples", pack(start_ns, columns, values))

        last = np.cumsum([len(o.stamp_s) for o in observations]) - 1
        pick = last[(-self._cycles) % PLOT_EVERY_CYCLES :: PLOT_EVERY_CYCLES]
        if len(pick) == 0:
            return
        ns = np.rint(stamp_s[pick] * 1e9).astype(np.int64)
        self._put_rows("/wrench", ns, plots.wrench(ns, wrench[pick]))
        self._put_rows("/pose", ns, plots.pose(ns, position[pick], quat[pick]))
        jaws = np.array([o.gripper.aperture_m for o in observations])
        jaws = jaws[(-self._cycles) % PLOT_EVERY_CYCLES :: PLOT_EVERY_CYCLES]
        self._put_rows("/tf", ns, plots.transforms(ns, self._frames, position[pick], quat[pick], q[pick], jaws))
        self._put_rows("/joints", ns, plots.joints(ns, q[pick], dq[pick]))

    def _encode_cycles(self, observations: list[Observation], commands: list[Command]) -> None:
        """Write the data of each cycle: the jaws and the command."""
        stamp_s = np.array([o.stamp_s[-1] for o in observations])
        jaws = np.array([(o.gripper.stamp_s, o.gripper.aperture_m, o.gripper.force_N) for o in observations])
        moving = np.array([o.gripper.moving for o in observations], dtype=np.float64)
        count = np.array([len(o.stamp_s) for o in observations], dtype=np.float64)
        dof = observations[0].q.shape[1]
        setpoint = np.full((len(commands), 2 * dof), np.nan)
        target = np.full((len(commands), 3), np.nan)
        tactile = np.array([c.tactile for c in commands], dtype=np.float64)
        move = [i for i, c in enumerate(commands) if c.motion is not None]
        if move:
            motions = [c.motion for c in commands if c.motion is not None]
            setpoint[move] = np.concatenate([[m.q for m in motions], [m.dq for m in motions]], axis=1)
        for i, c in enumerate(commands):
            if c.gripper is not None:
                target[i] = (c.gripper.aperture_m, c.gripper.speed_m_s, c.gripper.force_N)
        start_ns = _ns(stamp_s[0])
        columns = (
            Column("stamp_s", (), STAMP_S, 2),
            Column("samples", (), 1.0, 1),
            Column("gripper_stamp_s", (), STAMP_S, 2),
            Column("gripper_aperture_m", (), APERTURE_M, 1),
            Column("gripper_force_N", (), FORCE_N, 1),
            Column("gripper_moving", (), 1.0, 1),
            Column("command_q", (dof,), JOINT_RAD, 2),
            Column("command_dq", (dof,), JOINT_RAD_S, 1),
            Column("command_aperture_m", (), APERTURE_M, 1),
            Column("command_speed_m_s", (), SPEED_M_S, 1),
            Column("command_force_N", (), FORCE_N, 1),
            Column("command_tactile", (), 1.0, 1),
        )
        zero = start_ns * 1e-9
        values = (stamp_s - zero, count, jaws[:, 0] - zero, jaws[:, 1], jaws[:, 2], moving)
        ordered = (setpoint[:, :dof], setpoint[:, dof:], target[:, 0], target[:, 1], target[:, 2], tactile)
        self._put(start_ns, "/packed/cycles", pack(start_ns, columns, (*values, *ordered)))
        pick = slice((-self._cycles) % PLOT_EVERY_CYCLES, None, PLOT_EVERY_CYCLES)
        ns = np.rint(stamp_s[pick] * 1e9).astype(np.int64)
        self._put_rows("/gripper", ns, plots.gripper(ns, jaws[pick, 1], jaws[pick, 2], moving[pick]))

    def _encode_tactile(self, observations: list[Observation]) -> None:
        """Write every pair of depth maps packed, and at most ten pairs a second as images."""
        arrived = [(o.tactile, o.now_s) for o in observations if o.tactile is not None]
        if not arrived:
            return
        frames = [frame for frame, _ in arrived]
        start_ns = _ns(frames[0].stamp_s)
        shape = (frames[0].left_m.shape[0], frames[0].left_m.shape[1])
        columns = (
            Column("stamp_s", (), STAMP_S, 2),
            Column("arrived_s", (), STAMP_S, 2),
            Column("left_m", shape, DEPTH_M, 0),
            Column("right_m", shape, DEPTH_M, 0),
        )
        stamps = np.array([(f.stamp_s, arrived_s) for f, arrived_s in arrived]).T - start_ns * 1e-9
        values = (*stamps, np.stack([f.left_m for f in frames]), np.stack([f.right_m for f in frames]))
        self._put(start_ns, "/packed/tactile", pack(start_ns, columns, values))
        for frame in frames:
            ns = _ns(frame.stamp_s)
            if ns >= self._next_image_ns:
                self._next_image_ns = ns + _ns(IMAGE_EVERY_S)
                self._put(ns, "/tactile/left", plots.depth_image(ns, "pad_left", frame.left_m))
                self._put(ns, "/tactile/right", plots.depth_image(ns, "pad_right", frame.right_m))

    def _encode_images(self, observations: list[Observation], commands: list[Command]) -> None:
        """Write every pair of gel images, each a message of its own, and the cycles in which one was requested."""
        for o in observations:
            if o.images is not None:
                start_ns, shape = _ns(o.images.stamp_s), o.images.left.shape
                columns = (
                    Column("stamp_s", (), STAMP_S, 2),
                    Column("arrived_s", (), STAMP_S, 2),
                    Column("left", shape, 1.0, 0),
                    Column("right", shape, 1.0, 0),
                )
                stamps = np.array([[o.images.stamp_s], [o.now_s]]) - start_ns * 1e-9
                values = (*stamps, o.images.left[None], o.images.right[None])
                self._put(start_ns, "/packed/images", pack(start_ns, columns, values))
        asked_s = np.array([o.now_s for o, c in zip(observations, commands, strict=True) if c.images])
        if len(asked_s):
            start_ns = _ns(asked_s[0])
            column = Column("stamp_s", (), STAMP_S, 2)
            self._put(start_ns, "/packed/image_requests", pack(start_ns, (column,), (asked_s - start_ns * 1e-9,)))


def _ns(stamp_s: float) -> int:
    return round(float(stamp_s) * 1e9)


def _status(status: object) -> str:
    """Return the name of a py_trees Status, or the name given."""
    return str(getattr(status, "value", status))
