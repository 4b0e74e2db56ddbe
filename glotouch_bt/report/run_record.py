"""Read a run's folder: the arrays and events of run.mcap, result.json, and truth.json of a simulation.

Only the record is required. The record of a killed process is read up to its last complete chunk.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from mcap.exceptions import InvalidMagic
from mcap.records import Attachment, Chunk, Footer, McapRecord

from glotouch_bt.mission.record import (
    BROKEN,
    EVENT_PREFIX,
    MAX_RECORD_BYTES,
    RESULT_ATTACHMENT,
    RUN_ATTACHMENT,
    STAMP_S,
    ChunkUnpacker,
    join,
    open_record,
    record_items,
    to_step,
    unpack,
)
from glotouch_bt.robot import Array, BadInput, GlotouchError, Pose
from glotouch_bt.untrusted import MAX_JSON_BYTES, TooLarge, parse_json, read_json, require_plain

if TYPE_CHECKING:
    import pandas as pd

TREE_TOPICS = "/tree/"
"""Beginning of the topics of status changes and blackboard writes."""
RECORD_NAME, RESULT_NAME, TRUTH_NAME, FILM_NAME = "run.mcap", "result.json", "truth.json", "film.json"
ALL_TOPICS = (EVENT_PREFIX, "/packed/", TREE_TOPICS)
"""Beginnings of the topics that a reader needs for everything that a record holds; the others are drawings of it."""
_PACKED = {f"/packed/{name}": name for name in ("samples", "cycles", "tactile", "images", "image_requests")}


@dataclass(frozen=True)
class RecordedEvent:
    """An event of a skill; `data` is plain JSON (arrays are nested lists)."""

    stamp_s: float
    kind: str
    data: dict[str, Any]


@dataclass(frozen=True)
class Tick:
    """A status change of a tree node."""

    stamp_s: float
    node: str
    old: str
    new: str


@dataclass(frozen=True)
class PortWrite:
    """A blackboard write; large arrays are summarised as {shape, min, max}."""

    stamp_s: float
    key: str
    value: Any


@dataclass
class RunRecord:
    """The content of one run's folder.

    Attributes:
        path: The record's file.
        run: The run's description (run.json).
        result: result.json, of the folder or of the record; empty if the run never ended.
        truth: truth.json as it is, or None.
        samples: Full-rate columns (N, ...): stamp_s, q, dq, position_B_P, quat_B_P, force_S_N, torque_S_Nm.
        cycles: Once a control cycle: stamp_s, samples, gripper_*, command_* (NaN where there was no command).
        tactile: stamp_s and arrived_s (f,), left_m and right_m (f, rows, cols).
        images: stamp_s and arrived_s (k,), left and right (k, rows, cols, 3): the gel images; empty without any.
        image_requests: stamp_s (r,), the cycles whose command requested gel images; empty without any.
        events, ticks, ports: In the order of the record.
        complete: The record was closed properly.
        film: Rendered moments (film.json) as they are, or None.
        objects: Folder of the STL files of its objects, if it is not the recorded one.
    """

    path: Path
    run: dict[str, Any] = field(default_factory=dict)
    result: dict[str, Any] = field(default_factory=dict)
    truth: Any = None
    samples: dict[str, Array] = field(default_factory=dict)
    cycles: dict[str, Array] = field(default_factory=dict)
    tactile: dict[str, Array] = field(default_factory=dict)
    images: dict[str, Array] = field(default_factory=dict)
    image_requests: dict[str, Array] = field(default_factory=dict)
    events: list[RecordedEvent] = field(default_factory=list)
    ticks: list[Tick] = field(default_factory=list)
    ports: list[PortWrite] = field(default_factory=list)
    complete: bool = False
    film: Any = None
    objects: Path | None = None

    def of_kind(self, *kinds: str) -> list[RecordedEvent]:
        """Return the events of these kinds."""
        return [e for e in self.events if e.kind in kinds]

    @property
    def span_s(self) -> tuple[float, float]:
        """Robot clock of the first and the last entry; (0, 0) if there is none."""
        stamps = [e.stamp_s for e in self.events] + [t.stamp_s for t in self.ticks]
        if len(self.samples.get("stamp_s", ())):
            stamps += [float(self.samples["stamp_s"][0]), float(self.samples["stamp_s"][-1])]
        return (min(stamps), max(stamps)) if stamps else (0.0, 0.0)

    def of_run(self, *path: str) -> Any:
        """Return a value of the run's description by its path of keys, or None."""
        value: Any = self.run
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        return value

    def to_dataframe(self) -> pd.DataFrame:
        """Return the full-rate samples as a pandas table, indexed by `stamp_s` (s of robot time).

        A column of vectors becomes one column for each component: q_0 .. q_6, force_S_N_0 .. force_S_N_2.

        Raises:
            BadInput: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as e:
            raise BadInput(
                "to_dataframe needs pandas, which is not installed: pip install pandas "
                "(RunRecord.samples holds the same columns as NumPy arrays)"
            ) from e
        columns: dict[str, Array] = {}
        for name, values in self.samples.items():
            if values.ndim == 1:
                columns[name] = values
            else:
                columns |= {f"{name}_{i}": values[:, i] for i in range(values.shape[1])}
        return pd.DataFrame(columns).set_index("stamp_s")

    @property
    def pose_B_K(self) -> Pose | None:
        """The nominal container frame, if the description has it."""
        value = self.of_run("container", "pose_B_K")
        try:
            return Pose(np.array(value["position_m"], float), np.array(value["quat"], float))
        except (KeyError, ValueError, TypeError, GlotouchError):
            return None

    @property
    def interior_m(self) -> tuple[float, float, float] | None:
        """The container's interior, if the description has it."""
        value = self.of_run("container", "interior_m")
        return (
            (float(value[0]), float(value[1]), float(value[2])) if isinstance(value, list) and len(value) == 3 else None
        )


def read_run(path: str | Path) -> RunRecord:
    """Read a run's folder, or a record file.

    Raises:
        BadInput: There is no record, it is not an MCAP file at all, it unpacks to more than is allowed, or the folder
            holds links.
    """
    with RecordReader(path) as reader:
        reader.read()
        record = reader.record
        for name, parts in reader.packed.items():
            setattr(record, name, join(parts))
    folder = record.path.parent
    result = _json_file(folder / RESULT_NAME)
    record.result = result if isinstance(result, dict) and result else record.result
    record.truth, record.film = _json_file(folder / TRUTH_NAME), _json_file(folder / FILM_NAME)
    return record


class RecordReader:
    """Reads a record from its first byte to its last complete chunk, and on as it grows. Use it in a `with` block.

    Args:
        path: A run's folder, or a record file.
        growing: The file is being written; it may unpack to the largest size that is allowed for any record.
        topics: Beginnings of the topics to read.

    Attributes:
        record: What was read: description, events, ticks and ports. Its arrays are left empty.
        packed: The parts of the arrays, by the names of `RunRecord` (samples, cycles, tactile, images,
            image_requests), in the order of the file. The caller may take parts out.

    Raises:
        BadInput: There is no record, or the folder holds links.
    """

    def __init__(self, path: str | Path, *, growing: bool = False, topics: tuple[str, ...] = ALL_TOPICS) -> None:
        path = Path(path)
        if path.is_dir():
            require_plain(path, (RECORD_NAME, RESULT_NAME, TRUTH_NAME, FILM_NAME))
        file = path / RECORD_NAME if path.is_dir() else path
        if not file.is_file():
            raise BadInput(f"{path}: no run here ({RECORD_NAME} is missing)")
        self.record = RunRecord(file)
        self.packed: dict[str, list[dict[str, Array]]] = {name: [] for name in _PACKED.values()}
        self._file = open_record(file, links=not path.is_dir())
        self._at = self._text_bytes = 0
        self._shapes: dict[str, dict[str, tuple[int, ...]]] = {}
        size = MAX_RECORD_BYTES if growing else os.fstat(self._file.fileno()).st_size
        self._unpacker = ChunkUnpacker(size, str(file), topics)

    def read(self) -> bool:
        """Read every item that has been completed since the last call; return True if there was one.

        Raises:
            BadInput: It is not an MCAP file, or unpacks to more than is allowed.
        """
        if self.record.complete:
            return False
        before = self._at
        self._file.seek(self._at)
        try:
            for item in record_items(self._file, skip_magic=self._at > 0):
                self._at = self._file.tell()
                for topic, log_ns, data in self._messages(item):
                    self._store(topic, log_ns, data)
        except InvalidMagic as e:
            if not self.record.complete:  # else the last bytes of a complete record are cut off
                raise BadInput(f"{self.record.path}: is not an MCAP record") from e
        except TooLarge:
            raise
        except (*BROKEN, GlotouchError):
            pass  # a cut or damaged tail; what came before is valid
        return self._at > before

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _messages(self, item: McapRecord) -> Iterator[tuple[str, int, memoryview]]:
        """Yield topic, log time in ns and bytes of the messages except plots (the packed channels hold their data)."""
        record = self.record
        if isinstance(item, Attachment):
            content = parse_json(item.data, f"{record.path}: {item.name}")
            if item.name == RUN_ATTACHMENT and isinstance(content, dict):
                record.run = content
            elif item.name == RESULT_ATTACHMENT and isinstance(content, dict):
                record.result = content
        elif isinstance(item, Footer):
            record.complete = True
        elif isinstance(item, Chunk):
            for topic, log_ns, data in self._unpacker.items(item):
                if data is None:
                    continue
                self._text_bytes += 0 if topic in _PACKED else len(data)
                if self._text_bytes > MAX_JSON_BYTES:
                    raise TooLarge(f"{record.path}: its events are larger than {MAX_JSON_BYTES} bytes")
                yield topic, log_ns, data

    def _store(self, topic: str, log_ns: int, data: memoryview) -> None:
        """Store one message.

        Raises:
            ValueError, LookupError, TypeError, GlotouchError: It is damaged.
        """
        record = self.record
        if topic in _PACKED:
            start_ns, columns = unpack(data)
            for name in ("stamp_s", "gripper_stamp_s", "arrived_s"):
                if name in columns:
                    columns[name] = to_step(columns[name] + start_ns * 1e-9, STAMP_S)
            name = _PACKED[topic]
            shapes = {n: c.shape[1:] for n, c in columns.items()}
            if self._shapes.setdefault(name, shapes) != shapes:
                raise ValueError(f"{topic}: other columns than before")
            self.packed[name].append(columns)
            return
        content = parse_json(bytes(data), topic)
        stamp_s = log_ns * 1e-9
        if topic == "/tree/ticks":
            record.ticks.append(Tick(stamp_s, str(content["node"]), str(content["old"]), str(content["new"])))
        elif topic == "/tree/ports":
            record.ports.append(PortWrite(stamp_s, str(content["key"]), content["value"]))
        elif isinstance(content.get("data"), dict):
            record.events.append(RecordedEvent(stamp_s, str(content["kind"]), content["data"]))


def _json_file(path: Path) -> Any:
    """Return the file's content, or None if there is no file or it is not JSON."""
    try:
        return read_json(path)
    except BadInput:
        return None
