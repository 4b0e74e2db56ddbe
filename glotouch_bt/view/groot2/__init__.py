"""The tree of a mission for Groot2 and other monitors of BehaviorTree.CPP: `run --groot2` and `view --groot2`.

It speaks the protocol of that library's `Groot2Publisher` on this machine's loopback interface, from the record.
"""

from glotouch_bt.view.groot2.live import LiveTree
from glotouch_bt.view.groot2.mission_state import MissionState
from glotouch_bt.view.groot2.publisher import Groot2Publisher, published
