"""Open, read and write regular files, of bounded size, never through a symbolic link unless told to."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import IO

from glotouch_bt.errors import BadInput

_READ = os.O_RDONLY | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
_NO_LINKS = getattr(os, "O_NOFOLLOW", 0)


def open_file(
    path: Path, max_bytes: int, *, what: str = "a file", links: bool = False, shown: str | None = None
) -> IO[bytes]:
    """Open a regular file for reading.

    Args:
        path: The file.
        max_bytes: Largest size.
        what: The expected kind of file, for messages.
        links: Follow a symbolic link: for files that the user names, not for files in a folder of a stranger.
        shown: Name of the file in messages (default: the path).

    Raises:
        BadInput: It does not exist, cannot be read, is too large, or is a link, a folder, a device or a pipe.
    """
    shown = shown or str(path)
    try:
        _require_regular(os.stat(path, follow_symlinks=links), shown, what)  # before opening: a device may notice it
        handle = os.open(path, _READ | (0 if links else _NO_LINKS))
        file = os.fdopen(handle, "rb")
        found = os.fstat(handle)
    except (OSError, ValueError) as e:  # ValueError: a null byte in the name
        raise BadInput(f"{shown}: cannot be read ({_why(e)})") from e
    try:
        _require_regular(found, shown, what)
        if found.st_size > max_bytes:
            raise BadInput(f"{shown}: is larger than {max_bytes} bytes")
    except BaseException:
        file.close()
        raise
    return file


def read_file(
    path: Path, max_bytes: int, *, what: str = "a file", links: bool = False, shown: str | None = None
) -> bytes:
    """Return the content of a regular file; arguments and errors as for `open_file`."""
    shown = shown or str(path)
    with open_file(path, max_bytes, what=what, links=links, shown=shown) as file:
        try:
            data = file.read(max_bytes + 1)
        except OSError as e:
            raise BadInput(f"{shown}: cannot be read ({_why(e)})") from e
    if len(data) > max_bytes:  # it grew
        raise BadInput(f"{shown}: is larger than {max_bytes} bytes")
    return data


def read_start(path: Path, size: int) -> bytes:
    """Return the first bytes of a regular file; fewer if it is shorter, none if it is no regular file."""
    try:
        with open_file(path, 2**63 - 1) as file:
            return file.read(size)
    except (BadInput, OSError):
        return b""


def require_plain(folder: Path, names: Iterable[str]) -> None:
    """Require that each of these names in a folder is absent, a regular file or a folder.

    Raises:
        BadInput: One is a symbolic link, a device or a pipe.
    """
    for name in names:
        try:
            found = os.lstat(folder / name)
        except OSError:
            continue
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
            kind = "a symbolic link" if stat.S_ISLNK(found.st_mode) else "a device or a pipe"
            raise BadInput(f"{folder / name}: is {kind}; a run's folder holds none: remove it, or use another folder")


def create_file(path: Path) -> IO[bytes]:
    """Create a new file for writing, which must not exist; an earlier regular file of that name is removed first.

    Raises:
        OSError: It cannot be created; a link or a folder is in its place.
    """
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        pass
    else:
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EEXIST, "something that is no regular file is in its place", str(path))
        path.unlink()
    return os.fdopen(os.open(path, _CREATE | _NO_LINKS, 0o666), "wb")


def copy_file(source: Path, target: Path, max_bytes: int) -> None:
    """Copy a regular file to a new one.

    Raises:
        BadInput: See `open_file`.
        OSError: It cannot be written.
    """
    with open_file(source, max_bytes) as old, create_file(target) as new:
        shutil.copyfileobj(old, new)


def write_file(path: Path, data: bytes, *, durable: bool = False) -> None:
    """Write a file atomically: a part beside it, then a move. A link in its place is replaced, not followed.

    Args:
        path: The file.
        data: Its content.
        durable: Wait until the disk has it.

    Raises:
        OSError: It cannot be written; no part is left.
    """
    part = path.with_name(f".{path.name}.part")
    file = create_file(part)
    try:
        with file:
            file.write(data)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def _require_regular(found: os.stat_result, shown: str, what: str) -> None:
    mode = found.st_mode
    if stat.S_ISREG(mode):
        return
    kind = "folder" if stat.S_ISDIR(mode) else "symbolic link" if stat.S_ISLNK(mode) else "device or a pipe"
    raise BadInput(f"{shown}: is a {kind}, not {what}")


def _why(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)
