"""The reader opens regular files of bounded size only; the writer replaces links and leaves no parts."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import copy_file, create_file, open_file, read_file, read_start, require_plain, write_file


def test_a_file_is_read_whole(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"0123456789")
    assert read_file(tmp_path / "a", 10) == b"0123456789"
    assert read_start(tmp_path / "a", 4) == b"0123"
    assert read_start(tmp_path / "none", 4) == b""


@pytest.mark.parametrize("name", ["folder", "pipe", "link", "dead link", "none", "a\0b", "large", "/dev/zero"])
def test_all_else_is_refused_at_once(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(b"x" * 11)
    (tmp_path / "link").symlink_to("large")
    (tmp_path / "dead link").symlink_to("nothing")
    found: list[BaseException] = []

    def read() -> None:
        try:
            open_file(tmp_path / name, 10)
        except BaseException as e:
            found.append(e)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    thread.join(5.0)  # opening a pipe for reading waits for its writer
    assert not thread.is_alive()
    (error,) = found
    assert isinstance(error, BadInput)
    assert "is " in str(error) or "cannot be read" in str(error)


def test_links_that_the_user_names_are_followed(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"a")
    (tmp_path / "link").symlink_to("a")
    assert read_file(tmp_path / "link", 10, links=True) == b"a"
    with pytest.raises(BadInput, match="is a symbolic link, not a mission"):
        read_file(tmp_path / "link", 10, what="a mission")


@pytest.mark.parametrize("name", ["a", ".a.part"])
def test_a_link_is_never_written_through(tmp_path: Path, name: str) -> None:
    """In place of the file it is replaced; in place of the part the write is refused."""
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    (tmp_path / name).symlink_to(victim)
    if name == "a":
        write_file(tmp_path / "a", b"new", durable=True)
        assert (tmp_path / "a").read_bytes() == b"new"
        assert not (tmp_path / "a").is_symlink()
    else:
        with pytest.raises(OSError, match="no regular file"):
            write_file(tmp_path / "a", b"new")
    assert victim.read_bytes() == b"precious"
    (tmp_path / "b").symlink_to(victim)
    with pytest.raises(BadInput, match="symbolic link"):
        require_plain(tmp_path, ("a", "b"))


def test_what_a_killed_process_left_is_replaced(tmp_path: Path) -> None:
    (tmp_path / ".a.part").write_bytes(b"half")
    write_file(tmp_path / "a", b"whole")
    assert os.listdir(tmp_path) == ["a"]
    copy_file(tmp_path / "a", tmp_path / "b", 100)
    assert (tmp_path / "b").read_bytes() == b"whole"
    with pytest.raises(BadInput, match="larger"):
        copy_file(tmp_path / "a", tmp_path / "c", 2)
    with pytest.raises(FileNotFoundError):
        create_file(tmp_path / "none" / "a")
