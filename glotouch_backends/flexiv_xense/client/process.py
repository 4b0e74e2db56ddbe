"""The driver's process: started in a session of its own (Ctrl-C must not reach it), reached by a private socket."""

from __future__ import annotations

import pickle
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from glotouch_backends.flexiv_xense.client.options import Options
from glotouch_bt.robot import BackendError, Conditions, World

END_S = 15.0
INSTALLED, HERE = "glotouch_driver", "glotouch_backends.flexiv_xense.driver"
CELL = "glotouch_backends.flexiv_xense.simulated.cell"


class DriverProcess:
    """A driver of our own, and for simulated devices at real pace the cell they live in.

    Attributes:
        address: Where it listens.
        world: What the driver is told about the simulated world: a file or the cell's address.
        folder: Private; removed at the end, by the driver if this process is killed.
    """

    def __init__(self, options: Options) -> None:
        self._options = options
        self.folder = Path(tempfile.mkdtemp(prefix="glotouch-"))  # mode 0700
        self.address = f"ipc://{self.folder / 'driver'}"
        self.world = ""
        self.driver_log = Path(options.log) if options.log else self.folder / "driver.jsonl"
        self.cell_log = self.driver_log.with_name("cell.jsonl")
        self._process: subprocess.Popen[bytes] | None = None
        self._cell: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Of the driver."""
        return self._process.pid if self._process is not None else 0

    def put_world(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> None:
        """Leave the simulated world in a file that only we can read; for pace=real, start the cell with it."""
        path = self.folder / "world.pickle"
        path.write_bytes(pickle.dumps((world, conditions, seed, dict(options))))
        path.chmod(0o600)
        self.world = str(path)
        if self._options.pace == "real":
            address = str(self.folder / "cell")
            self._cell = self._spawn([sys.executable, "-m", CELL, str(path), address, str(self.cell_log)], "cell.txt")
            self.world = address

    def start(self) -> None:
        """Begin the driver; whether it comes up shows when it is talked to."""
        python = self._options.python
        module = HERE if python == sys.executable else INSTALLED
        arguments = ["--address", self.address, "--log", str(self.driver_log), "--private", str(self.folder)]
        arguments += [] if self._options.lockstep else ["--urgent"]
        self._process = self._spawn([python, "-m", module, *arguments], "driver.txt")

    def _spawn(self, command: list[str], output: str) -> subprocess.Popen[bytes]:
        try:
            with self.driver_log.with_name(output).open("wb") as out:
                return subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
                )
        except OSError as e:
            raise BackendError(f"{command[0]} cannot be started: {e}") from e

    def gone(self) -> str | None:
        """Why the driver has ended, or None while it runs."""
        if self._process is None or self._process.poll() is None:
            return None
        said = self.driver_log.with_name("driver.txt").read_text(errors="replace").strip().splitlines()
        why = f"exit code {self._process.returncode}"
        return why if not said else f"{why}: {said[-1]}"

    def end(self) -> None:
        """Wait for the driver to end by itself, else end it; then the cell. Idempotent."""
        for process in (self._process, self._cell):
            if process is None:
                continue
            if process is self._cell:
                process.terminate()
            try:
                process.wait(END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._process = self._cell = None
        shutil.rmtree(self.folder, ignore_errors=True)
