"""TODO door of glotouch_bt/mission/checkpoint."""

from glotouch_bt.mission.checkpoint.codec import decode, encode
from glotouch_bt.mission.checkpoint.store import FILE, CheckpointFile, Row
from glotouch_bt.mission.checkpoint.world_check import WorldChanged
from glotouch_bt.mission.checkpoint.writer import CheckpointHooks, CheckpointWriter, ResumePoint, RunState

__all__ = [
    "FILE",
    "CheckpointFile",
    "CheckpointHooks",
    "CheckpointWriter",
    "ResumePoint",
    "Row",
    "RunState",
    "WorldChanged",
    "decode",
    "encode",
]
