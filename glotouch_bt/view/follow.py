"""Follow the record of a run's folder as it grows."""

from __future__ import annotations

from pathlib import Path

from glotouch_bt.report import ALL_TOPICS, RECORD_NAME, RecordReader


class RecordFollower:
    """Reads the record of a run's folder: also one that does not exist yet, or that a resumed run replaces.

    Args:
        folder: The run's folder.
        topics: Beginnings of the topics to read.

    Attributes:
        reader: Reader of the present record; None before there is one.
        records: Number of records begun; it grows when a resumed run has replaced the record.
    """

    def __init__(self, folder: Path, topics: tuple[str, ...] = ALL_TOPICS) -> None:
        self._folder, self._topics = folder, topics
        self.reader: RecordReader | None = None
        self.records = 0
        self._inode = 0

    def read(self) -> bool:
        """Read what is new; return True if there was something.

        Raises:
            BadInput: It is not an MCAP file, or unpacks to more than is allowed, or the folder holds links.
        """
        try:
            inode = (self._folder / RECORD_NAME).stat().st_ino
        except OSError:
            return False  # not yet
        if inode != self._inode:
            self.close()
            self.reader, self._inode = RecordReader(self._folder, growing=True, topics=self._topics), inode
            self.records += 1
        assert self.reader is not None
        return self.reader.read()

    def close(self) -> None:
        """Close the record."""
        if self.reader is not None:
            self.reader.close()
