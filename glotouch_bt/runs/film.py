"""Rendered moments of a simulated run, from the worlds that its checkpoints hold."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from glotouch_bt.mission.checkpoint import CheckpointRow
from glotouch_bt.robot import BackendError, BadInput
from glotouch_bt.runs.folder import FILM
from glotouch_bt.runs.past_worlds import past_worlds
from glotouch_bt.untrusted import write_file

MOMENTS = 8
"""Maximum number of pictures. Source: ours; two rows of four on the page."""
SIZE = (480, 360)
"""Width and height of a picture, pixels."""
OVERSAMPLED = 2
"""Pictures are drawn larger by this factor, so that their edges become smooth."""


def write_film(folder: Path, objects: Path | None = None, settings: Mapping[str, str] | None = None) -> Path:
    """Render what the world looked like when the main skills of a run had ended, and write film.json into its folder.

    Args:
        folder: The run's folder.
        objects: Folder of STL files, if the run was made with one.
        settings: Backend options that the run's folder does not choose, such as the file of a robot.

    Raises:
        BadInput: The run has no simulated world or was made with another robot, its mission cannot be loaded, or the
            folder cannot be written.
        BackendError: The world cannot be built, or no picture can be taken here.
    """
    pictures = []
    with past_worlds(folder, objects, settings) as worlds:
        camera = worlds.backend.camera(worlds.robot)
        if camera is None:
            raise BadInput(f"{folder}: the backend {worlds.name!r} has no camera")
        for row in moments(worlds.rows):
            worlds.restore(row)
            jpeg = _jpeg(camera(*(OVERSAMPLED * s for s in SIZE)))
            pictures.append({"t_s": row.stamp_s, "node": row.node, "status": row.status, "jpeg": jpeg})
    target = folder / FILM
    try:
        write_file(target, json.dumps(pictures).encode())
    except OSError as e:
        raise BadInput(f"{target}: cannot be written ({e.strerror})") from e
    if not pictures:
        raise BackendError(f"{folder}: no checkpoint holds a simulated world")
    return target


def moments(rows: Sequence[CheckpointRow]) -> list[CheckpointRow]:
    """Return the last checkpoint after each kind of skill, in the order of time; at most `MOMENTS`, evenly chosen."""
    last = {r.node.rsplit("/", 1)[-1].rstrip(" 0123456789"): r for r in rows if r.node}
    found = sorted(last.values(), key=lambda r: r.number)
    if len(found) <= MOMENTS:
        return found
    return [found[i] for i in np.linspace(0, len(found) - 1, MOMENTS).round().astype(int).tolist()]


def _jpeg(picture: npt.ArrayLike) -> str:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.asarray(picture)).resize(SIZE, Image.Resampling.LANCZOS).save(
        out, "JPEG", quality=82, optimize=True
    )
    return base64.b64encode(out.getvalue()).decode()
