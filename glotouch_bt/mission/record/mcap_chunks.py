"""Read the chunks of a record within bounds. A resumed run's record starts with the first chunks of the old one."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, cast

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader

from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import TooLarge, open_file, unpack_zstd

MCAP_MAGIC = b"\x89MCAP0\r\n"
"""First bytes of an MCAP file."""
MAX_RECORD_BYTES = 8_000_000_000
"""Largest record file. Source: 24 h, the longest mission, take 4 GB."""
MAX_ITEM_BYTES = 64_000_000
"""Largest packed or unpacked chunk or attachment. Source: 200 times the largest chunk this program writes."""
MAX_UNPACKED_BYTES = 1 << 30
"""Maximum unpacked size of a record, bytes. Source: 85 minutes of a run."""
FREE_BYTES, MAX_RATIO = 1 << 28, 16
"""A record may unpack to FREE_BYTES, and beyond that to MAX_RATIO times its size; ours unpack to 5 times theirs."""
MAX_ITEMS = 4_000_000
"""Maximum number of messages and of channels of a record. Source: an hour has 1 million; counting them takes 2 s."""
BROKEN = (
    McapError, struct.error, OSError, LookupError, TypeError, ValueError, AttributeError, OverflowError,
    RecursionError, BadInput,
)  # fmt: skip
"""Errors that reading a damaged record can raise."""
_SCHEMA, _CHANNEL, _MESSAGE = 0x03, 0x04, 0x05
_HEAD, _MESSAGE_HEAD = struct.Struct("<BQ"), struct.Struct("<HIQQ")


@dataclass
class RecordChunk:
    """One chunk of a record.

    Attributes:
        topics: Topics of the channels that start in it, in order.
        messages: (log time ns, topic, message), in order.
    """

    topics: list[str] = field(default_factory=list)
    messages: list[tuple[int, str, bytes]] = field(default_factory=list)


def open_record(path: Path, *, links: bool = False) -> IO[bytes]:
    """Open a record; errors as for `untrusted.open_file`."""
    return open_file(path, MAX_RECORD_BYTES, what="an MCAP record", links=links)


class _BoundedReads:
    """A file that is not read in larger pieces than an item: lengths inside an item may be damaged, too."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def read(self, size: int = -1) -> bytes:
        if not 0 <= size <= MAX_ITEM_BYTES:
            raise BadInput(f"an item of the record states a length of {size} bytes")
        return self._file.read(size)


class _ItemReader(StreamReader):
    """A reader that skips what `record_items` does not yield, above all the index of every chunk."""

    def _read_record(self, opcode: int, length: int) -> McapRecord | None:
        if opcode in (Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.FOOTER):
            return super()._read_record(opcode, length)
        self._stream.read(length)
        return None


def record_items(file: IO[bytes], *, skip_magic: bool = False) -> Iterator[McapRecord]:
    """Yield the items of a record: chunks as they are, attachments, and the footer.

    Args:
        file: The record, at its beginning, or at the end of an item.
        skip_magic: The file does not stand at its beginning.

    Raises:
        BadInput: An item states too large a length.
    """
    bounded = cast("IO[bytes]", _BoundedReads(file))
    yield from _ItemReader(bounded, skip_magic=skip_magic, emit_chunks=True, record_size_limit=MAX_ITEM_BYTES).records


class ChunkUnpacker:
    """Unpack the chunks of one record, within the limits of all of them.

    Args:
        packed_bytes: Size of the record's file.
        shown: Its name, for messages.
        prefixes: Only messages of topics that begin with one of these are unpacked.
    """

    def __init__(self, packed_bytes: int, shown: str, prefixes: tuple[str, ...] = ("",)) -> None:
        self._left = min(MAX_UNPACKED_BYTES, FREE_BYTES + MAX_RATIO * packed_bytes)
        self._limit, self._shown = self._left, shown
        self._prefixes = prefixes
        self._topics: dict[int, str] = {}
        self._skipped: set[int] = set()
        self._items = 0

    def items(self, chunk: Chunk) -> Iterator[tuple[str, int, memoryview | None]]:
        """Yield (topic, log time ns, message) of the messages, and (topic, 0, None) of every channel that starts.

        Raises:
            TooLarge: The record unpacks to more than is allowed.
            BadInput: The chunk is damaged.
        """
        data = self._unpack(chunk)
        view, at, end = memoryview(data), 0, len(data)
        while at < end:
            code, size = _HEAD.unpack_from(data, at)
            at += _HEAD.size
            if size > end - at or not _SCHEMA <= code <= _MESSAGE:
                raise BadInput(f"{self._shown}: a chunk holds no messages where it should")
            self._items += 1
            if self._items > MAX_ITEMS:
                raise TooLarge(f"{self._shown}: unpacks to more than {MAX_ITEMS} messages")
            if code == _CHANNEL:
                number, _, length = struct.unpack_from("<HHI", data, at)
                self._topics[number] = topic = bytes(view[at + 8 : at + 8 + length]).decode()
                (self._skipped.discard if topic.startswith(self._prefixes) else self._skipped.add)(number)
                yield topic, 0, None
            elif code == _MESSAGE:
                number, _, log_ns, _ = _MESSAGE_HEAD.unpack_from(data, at)
                if number not in self._skipped:
                    yield self._topics[number], log_ns, view[at + _MESSAGE_HEAD.size : at + size]
            at += size

    def _unpack(self, chunk: Chunk) -> bytes:
        size = chunk.uncompressed_size
        if size > MAX_ITEM_BYTES or size > self._left:
            raise TooLarge(f"{self._shown}: unpacks to more than {self._limit} bytes")
        self._left -= size
        if chunk.compression == "":
            return bytes(chunk.data)
        if chunk.compression != "zstd":
            raise BadInput(f"{self._shown}: is compressed with {chunk.compression!r}; only zstd is read")
        return unpack_zstd(chunk.data, size, self._shown)


def read_chunks(path: Path, length: int) -> Iterator[RecordChunk]:
    """Yield each chunk, in the order written.

    Args:
        path: The record; it may end anywhere beyond `length`.
        length: Bytes to read, up to the end of a chunk.

    Raises:
        BadInput: The record is shorter, or damaged within that length.
    """
    with open_record(path) as file:
        head = file.read(min(length, MAX_RECORD_BYTES))
    if len(head) < length:
        raise BadInput(f"{path}: has {len(head)} bytes; the checkpoint was taken at {length}")
    stream, unpacker = io.BytesIO(head), ChunkUnpacker(length, str(path))
    try:
        for item in record_items(stream):
            if not isinstance(item, Chunk):
                continue
            chunk = RecordChunk()
            for topic, log_ns, message in unpacker.items(item):
                if message is None:
                    chunk.topics.append(topic)
                else:
                    chunk.messages.append((log_ns, topic, bytes(message)))
            yield chunk
    except TooLarge:
        raise
    except BROKEN as e:
        if stream.tell() < length:
            raise BadInput(f"{path}: damaged at byte {stream.tell()} ({type(e).__name__})") from e
