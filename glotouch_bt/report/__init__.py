"""The report of a run: `read_run` returns its arrays and events, `write_report` writes report.html."""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door
from glotouch_bt.report.run_record import (
    ALL_TOPICS,
    FILM_NAME,
    RECORD_NAME,
    TREE_TOPICS,
    TRUTH_NAME,
    PortWrite,
    RecordedEvent,
    RecordReader,
    RunRecord,
    Tick,
    read_run,
)

if TYPE_CHECKING:
    from glotouch_bt.report.sections import depth_png, palette
    from glotouch_bt.report.svg import AxisScale, points, tick_text
    from glotouch_bt.report.write import write_report

__getattr__ = lazy_door(
    __name__,
    depth_png="sections",
    palette="sections",
    AxisScale="svg",
    points="svg",
    tick_text="svg",
    write_report="write",
)
