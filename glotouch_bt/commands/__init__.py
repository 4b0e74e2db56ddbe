"""The commands behind `glotouch`, one file each, and what they print."""

from glotouch_bt.commands.bench import bench
from glotouch_bt.commands.check import bench_check, check
from glotouch_bt.commands.doctor import doctor, link
from glotouch_bt.commands.faults import bench_faults, faults
from glotouch_bt.commands.options import read_settings
from glotouch_bt.commands.pause import bench_pause
from glotouch_bt.commands.replay import replay
from glotouch_bt.commands.resume import bench_resume, resume
from glotouch_bt.commands.test import bench_fuzz, mission_tests

__all__ = [
    "bench",
    "bench_check",
    "bench_faults",
    "bench_fuzz",
    "bench_pause",
    "bench_resume",
    "check",
    "doctor",
    "faults",
    "link",
    "mission_tests",
    "read_settings",
    "replay",
    "resume",
]
