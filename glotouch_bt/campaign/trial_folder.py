"""The folder of a trial: the claim of the process that runs it, its result, and the attempts that were lost.

A claim is a lock of the operating system on the file `.claim`. It ends with the process that holds it, however that
process ends, so that no clock decides whether an owner is dead.
"""

from __future__ import annotations

import json
import math
import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from glotouch_bt.campaign.identity import difference
from glotouch_bt.campaign.workers import Claimed
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.runs import RunFolder
from glotouch_bt.untrusted import read_json, write_file

CLAIM = ".claim"
"""Name of the locked file; it says which process had the folder last."""
TRIAL = "trial.json"
"""Name of the file with the result and with all that it depends on."""
LOST = ".lost.json"
"""Name of the file with the causes of the attempts that were lost."""
_NUMBER = "number"
"""Key of a number that JSON does not have."""


@contextmanager
def claimed(folder: Path, *, wait: bool = False) -> Iterator[bool]:
    """Lock a folder for this process until the block or the process ends; yield True if it was claimed before.

    Args:
        folder: The folder; it is created.
        wait: Wait for the process that holds it.

    Raises:
        Claimed: Another process holds it.
        GlotouchError: The folder cannot be written, or its file system has no locks.
    """
    import fcntl

    path = folder / CLAIM
    try:
        folder.mkdir(parents=True, exist_ok=True)
        before = path.exists()
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
    except OSError as e:
        raise GlotouchError(f"{folder}: cannot be written ({e.strerror})") from e
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError as e:
            raise Claimed(f"{folder}: another process runs this trial ({_owner(handle)})") from e
        except OSError as e:
            raise GlotouchError(f"{folder}: cannot be locked ({e.strerror})") from e
        owner = f"{socket.gethostname()} process {os.getpid()}\n".encode()
        with suppress(OSError):  # a full disk: the lock holds without the name of its owner
            os.ftruncate(handle, os.pwrite(handle, owner, 0))
        yield before
    finally:
        os.close(handle)


def _owner(handle: int) -> str:
    return os.pread(handle, 200, 0).decode(errors="replace").strip() or "unknown"


class TrialFolder:
    """Access to the result and the lost attempts of a trial.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self, identity: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return the row of the finished trial, or None if it is not finished.

        Args:
            identity: All that the row depends on, as plain JSON data.

        Raises:
            BadInput: The folder holds a trial with another identity; the message names the differences.
        """
        if not os.path.lexists(self.path / TRIAL):
            return None
        made, row = self.kept()
        if made != identity:
            raise BadInput(
                f"{self.path}: holds a trial that was made otherwise: {difference(made, identity)}; "
                "continue with the same code and options, or give another folder"
            )
        return row

    def kept(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the identity and the row of the finished trial, whatever made it.

        Raises:
            BadInput: There is none, or it cannot be read.
        """
        path = self.path / TRIAL
        kept = read_json(path)
        if not isinstance(kept, dict) or not all(isinstance(kept.get(k), dict) for k in ("identity", "row")):
            raise BadInput(f"{path}: is not a trial of a campaign; remove it to run this trial again")
        return kept["identity"], _decoded(kept["row"])

    def write(self, identity: Mapping[str, Any], row: Mapping[str, Any]) -> dict[str, Any]:
        """Keep the row, whole or not at all; return it as `read` will.

        Raises:
            GlotouchError: It cannot be written.
        """
        encoded = _encoded(row)
        RunFolder(self.path).write_text(TRIAL, json.dumps({"identity": identity, "row": encoded}, indent=1) + "\n")
        plain: dict[str, Any] = _decoded(json.loads(json.dumps(encoded)))
        return plain

    def lost(self) -> list[str]:
        """Return the causes of the attempts that were lost."""
        with suppress(BadInput):
            found = read_json(self.path / LOST)
            return [str(cause) for cause in found] if isinstance(found, list) else []
        return []

    def note_lost(self, causes: list[str]) -> None:
        """Keep the causes of lost attempts, if the disk takes them."""
        with suppress(OSError):
            write_file(self.path / LOST, json.dumps(causes).encode())


def _encoded(value: Any) -> Any:
    """Return data in which every number that JSON does not have is an object with its name."""
    if isinstance(value, Mapping):
        return {str(k): _encoded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_encoded(v) for v in value]
    return {_NUMBER: repr(float(value))} if isinstance(value, float) and not math.isfinite(value) else value


def _decoded(value: Any) -> Any:
    if isinstance(value, dict):
        return float(value[_NUMBER]) if value.keys() == {_NUMBER} else {k: _decoded(v) for k, v in value.items()}
    return [_decoded(v) for v in value] if isinstance(value, list) else value
