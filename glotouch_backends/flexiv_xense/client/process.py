"""The driver's process: in its own session, so that Ctrl-C does not reach it, and behind a private socket."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from glotouch_backends.flexiv_xense.client.options import ClientOptions
from glotouch_bt.robot import BackendError, BadInput

END_S = 15.0
"""Longest wait for a process to end before it is killed."""
INSTALLED, HERE = "glotouch_driver", "glotouch_backends.flexiv_xense.driver"
CELL = "glotouch_backends.flexiv_xense.simulated.cell"


class DriverProcess:
    """A driver that we start, and for simulated devices at real pace the cell that contains them.

    Attributes:
        address: Address of the driver's socket.
        folder: Private folder; removed at the end, by the driver if this process is killed.
    """

    def __init__(self, options: ClientOptions) -> None:
        self._options = options
        self.folder = Path(tempfile.mkdtemp(prefix="glotouch-"))  # mode 0700
        self.address = f"ipc://{self.folder / 'driver'}"
        self.driver_log = Path(options.log) if options.log else self.folder / "driver.jsonl"
        self.cell_log = self.driver_log.with_name("cell.jsonl")
        self._process: subprocess.Popen[bytes] | None = None
        self._cell: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Process id of the driver; 0 before it starts."""
        return self._process.pid if self._process is not None else 0

    def start(self, trial: bytes) -> None:
        """Start the driver; the first request shows whether it came up.

        Args:
            trial: Message with the simulated world, for the cell of pace=real; empty for real devices.
        """
        python = self._options.python
        module = HERE if python == sys.executable else INSTALLED
        arguments = ["--address", self.address, "--log", str(self.driver_log), "--private", str(self.folder)]
        if self._options.lockstep:
            arguments += ["--simulated"]
        elif trial:
            world, cell = self.folder / "world", str(self.folder / "cell")
            world.touch(0o600, exist_ok=False)
            world.write_bytes(trial)
            self._cell = self._spawn([sys.executable, "-m", CELL, str(world), cell, str(self.cell_log)], "cell.txt")
            arguments += ["--cell", cell]
        arguments += [] if self._options.lockstep else ["--urgent"]
        self._process = self._spawn([python, "-m", module, *arguments], "driver.txt")

    def _spawn(self, command: list[str], output: str) -> subprocess.Popen[bytes]:
        try:
            path, flags = self.driver_log.with_name(output), os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW
            with open(os.open(path, flags, 0o600), "ab") as out:
                return subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
                )
        except OSError as e:
            raise BackendError(f"{command[0]} cannot be started: {e}") from e

    def gone(self) -> str | None:
        """Return a sentence that says why the driver or the cell has ended, or None while both run.

        Raises:
            BadInput: The cell cannot build its world.
        """
        for name, process in (("driver", self._process), ("cell", self._cell)):
            if process is None or (code := process.poll()) is None:
                continue
            why = f"the {name} has ended: "
            why += f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"
            said = self.driver_log.with_name(f"{name}.txt").read_text(errors="replace").strip().splitlines()
            if process is self._cell and code == 2 and said:
                raise BadInput(said[-1])
            return f"{why}: {said[-1]}" if said and code >= 0 else why
        return None

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
