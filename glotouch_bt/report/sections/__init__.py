"""The sections of the report: one file each, with one function that takes the record and returns HTML or nothing.

To add a section, write its file and add it to `SECTIONS`, which gives the order on the page.
"""

from collections.abc import Callable

from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.sections.about import about_section
from glotouch_bt.report.sections.decisions import decisions_section
from glotouch_bt.report.sections.faults import faults_section
from glotouch_bt.report.sections.film import film_section
from glotouch_bt.report.sections.force import force_section
from glotouch_bt.report.sections.header import header_section, verdict
from glotouch_bt.report.sections.log import log_section
from glotouch_bt.report.sections.map import map_section
from glotouch_bt.report.sections.reasons import reasons_section
from glotouch_bt.report.sections.recognition import recognition_section
from glotouch_bt.report.sections.scene import SCENE_ID, scene_section
from glotouch_bt.report.sections.skills import skills_section
from glotouch_bt.report.sections.squeezes import depth_png, palette, squeezes_section
from glotouch_bt.report.sections.tree import tree_section

SECTIONS: tuple[tuple[str, Callable[[RunRecord], str]], ...] = (
    ("Verdict", header_section),
    ("Why", reasons_section),
    ("Injected faults", faults_section),
    ("Scene", scene_section),
    ("Moments", film_section),
    ("Map", map_section),
    ("Reports of skills", skills_section),
    ("Force", force_section),
    ("Squeezes", squeezes_section),
    ("Decisions", decisions_section),
    ("Recognition", recognition_section),
    ("Behavior tree", tree_section),
    ("Log", log_section),
    ("About this run", about_section),
)
"""Title and function of each section, in the order of the page."""
