"""Write report.html of a run: its verdict and numbers, then one section per topic (`sections`)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from glotouch_bt.report.page import esc, page, section
from glotouch_bt.report.run_record import RunRecord, read_run
from glotouch_bt.report.scene import script
from glotouch_bt.report.sections import SCENE_ID, SECTIONS, verdict
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.untrusted import require_plain, write_file

REPORT_NAME = "report.html"


def write_report(run_dir: Path, objects: Path | None = None) -> Path:
    """Write report.html into a run's folder from run.mcap, result.json and, if present, truth.json.

    Sections without data are left out. The file is written atomically.

    Args:
        run_dir: The run's folder.
        objects: Folder of the STL files of its objects, if they are not shipped.

    Returns:
        The file written.

    Raises:
        BadInput: There is no record, or nothing in it, or the folder cannot be written or holds links.
    """
    require_plain(run_dir, (REPORT_NAME, f".{REPORT_NAME}.part"))
    target = run_dir / REPORT_NAME
    record = read_run(run_dir)
    if not (record.run or record.events or record.ticks):
        raise BadInput(f"{record.path}: is empty or cut off in its first bytes; there is nothing to report")
    record.objects = objects
    text = render(record)
    try:
        write_file(target, text.encode("utf-8", "backslashreplace"))
    except OSError as e:
        raise BadInput(f"{target}: the report cannot be written ({e.strerror})") from e
    return target


def render(record: RunRecord) -> str:
    """Return the report's HTML."""
    sections = [_section(title, make, record) for title, make in SECTIONS]
    mission = record.result.get("mission") or record.run.get("mission") or "run"
    body = "".join(sections)
    return page(f"{mission} · {verdict(record)[1]}", body, script() if SCENE_ID in body else "")


def _section(title: str, make: Callable[[RunRecord], str], record: RunRecord) -> str:
    """Return one section; data that cannot be read (of another version) cost only this section."""
    try:
        return make(record)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, GlotouchError) as e:
        return section(title, f"This part of the record could not be read ({esc(type(e).__name__)}: {esc(e)}).", "")
