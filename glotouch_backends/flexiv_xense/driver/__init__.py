"""The driver: a small process that runs the vendors' SDKs and stops the arm if its client fails.

It needs only Python 3.10, numpy, pyzmq, msgspec and the SDKs, is installed as `glotouch_driver`, and imports nothing
else of this project. Its client imports `messages` from here.
"""

from . import messages
from .clock import Clock, SteppedClock, WallClock
from .devices import Vendor
from .endpoint import HEARTBEAT_SUFFIX, load_secret_key
from .priority import DEVICES_PRIORITY, request_realtime
