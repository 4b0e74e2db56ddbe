"""TODO door of glotouch_bt/run."""

from glotouch_bt.run.folder import RunFolder
from glotouch_bt.run.launch import RunRequest, RunResult, launch
from glotouch_bt.run.result import installed_versions
from glotouch_bt.run.resume import resume
from glotouch_bt.run.resume_point import EARLIER, ResumableRun, copy_run, find

__all__ = [
    "EARLIER",
    "ResumableRun",
    "RunFolder",
    "RunRequest",
    "RunResult",
    "copy_run",
    "find",
    "installed_versions",
    "launch",
    "resume",
]
