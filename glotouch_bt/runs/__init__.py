"""One run of a mission, from the request to the folder with its result; resume and replay of recorded runs."""

from glotouch_bt.runs.film import write_film
from glotouch_bt.runs.folder import EARLIER, RunFolder, holds_run
from glotouch_bt.runs.launch import RunRequest, RunResult, launch
from glotouch_bt.runs.operator import Operator, operated
from glotouch_bt.runs.past_worlds import past_worlds
from glotouch_bt.runs.result import installed_versions
from glotouch_bt.runs.resume import resume
from glotouch_bt.runs.resume_point import ResumableRun, copy_run, find_resumable
from glotouch_bt.runs.robot_identity import robot_identity
