"""A record from a stranger is bounded before it is unpacked, and damaged parts end it."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
import zstandard

from glotouch_bt.mission.record import mcap_chunks, read_chunks, unpack
from glotouch_bt.mission.record.mcap_packing import Column
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.report import read_run, write_report
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.untrusted import TooLarge


def chunk(
    content: bytes, *, packed: bytes | None = None, size: int | None = None, compression: bytes = b"zstd"
) -> bytes:
    """An MCAP chunk record with this content."""
    packed = zstandard.compress(content) if packed is None else packed
    size = len(content) if size is None else size
    body = struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", len(compression)) + compression
    body += struct.pack("<Q", len(packed)) + packed
    return b"\x06" + struct.pack("<Q", len(body)) + body


def record(path: Path, *chunks: bytes) -> Path:
    """A record that ends with these chunks."""
    with Recorder(path, {"mission": "m"}) as recorder:
        recorder.event("note", 1.0, {"text": "here"})
        length = recorder.flush()
    path.write_bytes(path.read_bytes()[:length] + b"".join(chunks))
    return path


BOMB = struct.pack("<BQ", 3, 60_000_000) + bytes(60_000_000)
BOMBS = {
    "many chunks": [chunk(BOMB)] * 60,
    "one chunk": [chunk(b"", packed=zstandard.compress(bytes(10**9)), size=10**9)],
    "a chunk that says less": [chunk(b"", packed=zstandard.compress(bytes(10**9)), size=100)],
    "a chunk of all sizes": [chunk(b"x", size=2**63)],
}


@pytest.mark.parametrize("what", BOMBS)
def test_a_bomb_is_bad_input(tmp_path: Path, what: str) -> None:
    """A few kilobytes that unpack to gigabytes."""
    path = record(tmp_path / "run.mcap", *BOMBS[what])
    assert path.stat().st_size < 200_000
    for read in (read_run, write_report, lambda folder: list(read_chunks(folder / "run.mcap", path.stat().st_size))):
        with pytest.raises(TooLarge, match="unpacks to"):
            read(tmp_path)


def test_too_many_messages_are_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_chunks, "MAX_ITEMS", 40_000)
    path = record(tmp_path / "run.mcap", chunk(struct.pack("<BQ", 3, 0) * 40_001))
    for read in (read_run, write_report, lambda folder: list(read_chunks(folder / "run.mcap", path.stat().st_size))):
        with pytest.raises(TooLarge, match="unpacks to"):
            read(tmp_path)


UNKNOWN_CHANNEL = b"\x05" + struct.pack("<Q", 30) + struct.pack("<HIQQ", 99, 0, 0, 0) + bytes(8)
_ATTACHMENT = struct.pack("<QQIIQ", 0, 0, 0, 0, 2**60) + b"data" + bytes(4)
LONG_ATTACHMENT = b"\x09" + struct.pack("<Q", len(_ATTACHMENT)) + _ATTACHMENT
"""Its data says to be longer than the file, which must not be allocated."""
DAMAGED = [
    chunk(b"", packed=b"rubbish", size=7),
    chunk(b"x", compression=b"lz4"),
    chunk(b"\x05" + struct.pack("<Q", 2**60)),
    chunk(UNKNOWN_CHANNEL),
    chunk(bytes(1000)),
    b"\x06" + struct.pack("<Q", 2**62),
    LONG_ATTACHMENT,
]


@pytest.mark.parametrize("bad", DAMAGED)
def test_a_damaged_chunk_ends_the_record(tmp_path: Path, bad: bytes) -> None:
    found = read_run(record(tmp_path / "run.mcap", bad))
    assert not found.complete
    assert [e.kind for e in found.events] == ["note"]


def test_too_much_text_is_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glotouch_bt.report.run_record.MAX_JSON_BYTES", 20)
    with pytest.raises(TooLarge, match="events are larger"):
        read_run(record(tmp_path / "run.mcap"))


def test_limits_leave_room_for_the_longest_mission() -> None:
    assert mcap_chunks.MAX_UNPACKED_BYTES > 3600 * 250_000


@pytest.mark.parametrize(
    "word", ["a:1:0:1", "a:1:nan:1", "a:1:-1:1", "a:1:1:99999999999", "a:-1:1:1", "a:0:1:1", "a:1x1x1x1x1:1:1"]
)
def test_layouts_out_of_bounds_are_refused(word: str) -> None:
    with pytest.raises(ValueError, match="a column"):
        Column.parse(word)


@pytest.mark.parametrize(
    "message", [b"", b"\x80" * 1000, b"\x08\x01\x10\x05\x1a\x07a:1:1:0\x22\x00", b"\x10" + b"\xff" * 9 + b"\x01"]
)
def test_messages_that_hold_less_than_they_say_are_refused(message: bytes) -> None:
    with pytest.raises(GlotouchError):
        unpack(message)


def test_a_replay_of_nothing_is_not_the_same(tmp_path: Path) -> None:
    from glotouch_bt.runs.replay import replay

    record(tmp_path / "run.mcap")
    with pytest.raises(BadInput, match="no robot description or no observations"):
        replay(tmp_path)
