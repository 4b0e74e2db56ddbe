"""Keys (CURVE) for a driver that listens on the network: who has no key that the driver knows cannot connect."""

from __future__ import annotations

import os
import re
from pathlib import Path

from glotouch_bt.robot import BadInput

DRIVER = "driver"
"""Folder for the driver's computer."""


def write_keys(folder: Path, client: str = "client") -> list[Path]:
    """Make the keys of a driver, unless they exist, and of one client; return the files written.

    `folder/driver` is for the driver's computer and `folder/CLIENT` for the client's. Only their owner can read the
    folders and the files with secret keys.

    Args:
        folder: Receives both folders.
        client: Name of the client.

    Raises:
        BadInput: The name is no plain word, the client has keys already, or the folder cannot be written.
    """
    import zmq

    if re.fullmatch(r"\w[\w-]{0,63}", client) is None or client == DRIVER:
        raise BadInput(f"--client {client}: must be one word of letters, digits, _ and -, and not {DRIVER!r}")
    written: list[Path] = []

    def write(path: Path, mode: int, public: bytes, secret: bytes | None = None) -> None:
        lines = ["metadata", "curve", f'    public-key = "{public.decode()}"']
        lines += [] if secret is None else [f'    secret-key = "{secret.decode()}"']
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
        with open(os.open(path, flags, mode), "w", encoding="ascii") as file:
            file.write("\n".join(lines) + "\n")
        written.append(path)

    here, there = folder / client, folder / DRIVER
    try:
        folder.mkdir(parents=True, exist_ok=True)
        here.mkdir(0o700)
        if not there.exists():
            (there / "clients").mkdir(0o700, parents=True)
            there.chmod(0o700)
            public, secret = zmq.curve_keypair()
            write(there / "driver.key_secret", 0o600, public, secret)
            write(there / "driver.key", 0o644, public)
        public, secret = zmq.curve_keypair()
        write(here / "client.key_secret", 0o600, public, secret)
        write(there / "clients" / f"{client}.key", 0o644, public)
        driver = (there / "driver.key").read_text(encoding="ascii")
        (here / "driver.key").write_text(driver, encoding="ascii")
    except FileExistsError as e:
        raise BadInput(f"{e.filename}: exists already; give another folder, or another --client") from e
    except (OSError, zmq.ZMQError) as e:
        raise BadInput(f"{folder}: keys cannot be made here ({e.strerror})") from e
    return [*written, here / "driver.key"]
