"""The driver's process: in its own session, so that Ctrl-C does not reach it, and behind a private socket."""

from __future__ import annotations

import pickle
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from glotouch_backends.flexiv_xense.client.options import ClientOptions
from glotouch_backends.options import WorldOptions
from glotouch_bt.robot import BackendError, Conditions, World

END_S = 15.0
"""Longest wait for a process to end before it is killed."""
INSTALLED, HERE = "glotouch_driver", "glotouch_backends.flexiv_xense.driver"
CELL = "glotouch_backends.flexiv_xense.simulated.cell"


class DriverProcess:
    """A driver that we start, and for simulated devices at real pace the cell that contains them.

    Attributes:
        address: Address of the driver's socket.
        world: File with the simulated world, or the cell's address.
        folder: Private folder; removed at the end, by the driver if this process is killed.
    """

    def __init__(self, options: ClientOptions) -> None:
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
        """Process id of the driver; 0 before it starts."""
        return self._process.pid if self._process is not None else 0

    def put_world(self, world: World, conditions: Conditions, seed: int, options: WorldOptions) -> None:
        """Write the simulated world to a private file; for pace=real, start the cell with it."""
        path = self.folder / "world.pickle"
        path.write_bytes(pickle.dumps((world, conditions, seed, options)))
        path.chmod(0o600)
        self.world = str(path)
        if self._options.pace == "real":
            address = str(self.folder / "cell")
            self._cell = self._spawn([sys.executable, "-m", CELL, str(path), address, str(self.cell_log)], "cell.txt")
            self.world = address

    def start(self) -> None:
        """Start the driver; the first request shows whether it came up."""
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
        """Return why the driver has ended, or None while it runs."""
        if self._process is None or self._process.poll() is None:
            return None
        said = self.driver_log.with_name("driver.txt").read_text(errors="replace").strip().splitlines()
        why = f"exit code {self._process.returncode}"
        return why if not said else f"{why}: {said[-1]}"

    def end(self) -> None:
        """Wait for the driver to end, kill it if it does not, then end the cell. Idempotent."""
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
