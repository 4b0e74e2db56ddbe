"""The section of the rendered moments of a simulated run, if film.json was written."""

from __future__ import annotations

import base64
import binascii

from glotouch_bt.report.page import esc, section
from glotouch_bt.report.run_record import RunRecord

MAX_PICTURES = 40
"""Maximum number of pictures shown."""
JPEG = b"\xff\xd8\xff"
"""First bytes of a JPEG file."""


def film_section(record: RunRecord) -> str:
    """Return the pictures with the skill that had ended, or nothing without any."""
    figures = []
    for moment in record.film[:MAX_PICTURES] if isinstance(record.film, list) else []:
        try:
            data, t_s = base64.b64decode(moment["jpeg"], validate=True), float(moment["t_s"])
        except (binascii.Error, LookupError, TypeError, ValueError):
            continue
        if data.startswith(JPEG):
            name, failed = str(moment.get("node")).rsplit("/", 1)[-1], moment.get("status") == "FAILURE"
            said = f"<b>{t_s:.1f} s</b> after {esc(name)}{' failed' if failed else ''}"
            source = f"data:image/jpeg;base64,{base64.b64encode(data).decode()}"
            figures.append(f'<figure><img alt="{esc(name)}" src="{source}"><figcaption>{said}</figcaption></figure>')
    if not figures:
        return ""
    lead = "The simulated world when skills had ended, drawn from the checkpoints. No skill sees it."
    return section("Moments", lead, f'<div class="film">{"".join(figures)}</div>')
