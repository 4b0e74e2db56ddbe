"""Read the first chunks of a record, which the record of a resumed run starts with."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

from glotouch_bt.robot import BadInput


@dataclass
class RecordChunk:
    """One chunk of a record.

    Attributes:
        topics: Topics of the channels that start in it, in order.
        messages: (log time ns, topic, message), in order.
    """

    topics: list[str] = field(default_factory=list)
    messages: list[tuple[int, str, bytes]] = field(default_factory=list)


def read_chunks(path: Path, length: int) -> Iterator[RecordChunk]:
    """Yield each chunk, in the order written.

    Args:
        path: The record; it may end anywhere beyond `length`.
        length: Bytes to read, up to the end of a chunk.

    Raises:
        BadInput: The record is shorter, or damaged within that length.
    """
    try:
        with path.open("rb") as file:
            head = file.read(length)
    except OSError as e:
        raise BadInput(f"{path}: cannot be read ({e.strerror})") from e
    if len(head) < length:
        raise BadInput(f"{path}: has {len(head)} bytes; the checkpoint was taken at {length}")
    stream, topics = io.BytesIO(head), dict[int, str]()
    try:
        for item in StreamReader(stream, emit_chunks=True).records:
            if isinstance(item, Chunk):
                chunk = RecordChunk()
                for inside in breakup_chunk(item):
                    if isinstance(inside, Channel):
                        topics[inside.id] = inside.topic
                        chunk.topics.append(inside.topic)
                    elif isinstance(inside, Message):
                        chunk.messages.append((inside.log_time, topics[inside.channel_id], inside.data))
                yield chunk
    except (McapError, struct.error, zstandard.ZstdError, KeyError, ValueError, OverflowError) as e:
        if stream.tell() < length:
            raise BadInput(f"{path}: damaged at byte {stream.tell()} ({type(e).__name__})") from e
