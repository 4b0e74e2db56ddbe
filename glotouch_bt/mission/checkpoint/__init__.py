"""Save a running mission after every skill, and continue it from a checkpoint in a new process."""

from glotouch_bt.mission.checkpoint.codec import decode, encode
from glotouch_bt.mission.checkpoint.store import CHECKPOINT_FILE, CheckpointFile, CheckpointRow
from glotouch_bt.mission.checkpoint.world_check import WorldChanged
from glotouch_bt.mission.checkpoint.writer import UNFIT, CheckpointHooks, CheckpointWriter, ResumePoint, RunState
