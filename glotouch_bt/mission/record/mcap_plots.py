"""Format the plottable JSON messages of many control cycles with one format operation per channel.

Each function returns the messages of one channel, one per row, in order. Numbers that are not finite become null.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from glotouch_bt.mission.record.mcap_robot import LinkFrames
from glotouch_bt.robot import Array

Stamps = npt.NDArray[np.int64]
_NOT_FINITE = re.compile(r"-?\b(?:nan|inf)\b")
_TIME = '{"sec":%d,"nsec":%d}'
_PLACE, _TURN = '{"x":%.6f,"y":%.6f,"z":%.6f}', '{"x":%.7f,"y":%.7f,"z":%.7f,"w":%.7f}'


def _rows(template: str, stamps_ns: Stamps, *columns: npt.ArrayLike) -> list[bytes]:
    """Fill `template` once per row: sec and nsec first, then the columns side by side."""
    return _filled(template, [stamps_ns // 10**9, stamps_ns % 10**9, *columns])


def _filled(template: str, blocks: Sequence[npt.ArrayLike]) -> list[bytes]:
    """Fill `template` once per row of the columns side by side."""
    rows = len(np.asarray(blocks[0]))
    if rows == 0:
        return []
    table = np.column_stack([np.asarray(b, dtype=np.float64).reshape(rows, -1) for b in blocks])
    text = "\n".join([template] * rows) % tuple(table.ravel().tolist())
    if not np.isfinite(table).all():
        text = _NOT_FINITE.sub("null", text)
    return text.encode().split(b"\n")


def wrench(stamps_ns: Stamps, wrench_S: Array) -> list[bytes]:
    """Return glotouch.Wrench of `wrench_S` (n, 6): force N, torque Nm, and the magnitude of the force."""
    xyz = '{"x":%.4f,"y":%.4f,"z":%.4f}'
    tail = '{"x":%.5f,"y":%.5f,"z":%.5f}'
    norm = np.sqrt((wrench_S[:, :3] ** 2).sum(axis=1))
    template = f'{{"timestamp":{_TIME},"frame_id":"S","force":{xyz},"torque":{tail},"force_N":%.4f}}'
    return _rows(template, stamps_ns, wrench_S, norm)


def pose(stamps_ns: Stamps, position_B_P: Array, quat_B_P: Array) -> list[bytes]:
    """Return foxglove.PoseInFrame of P in B: (n, 3) m and (n, 4) w x y z."""
    template = f'{{"timestamp":{_TIME},"frame_id":"B","pose":{{"position":{_PLACE},"orientation":{_TURN}}}}}'
    return _rows(template, stamps_ns, position_B_P, quat_B_P[:, [1, 2, 3, 0]])


def transforms(
    stamps_ns: Stamps, frames: LinkFrames, position_B_P: Array, quat_B_P: Array, q: Array, aperture_m: Array
) -> list[bytes]:
    """Return foxglove.FrameTransforms of all frames of the robot; see `LinkFrames.columns`."""
    return _filled(frames.template, frames.columns(stamps_ns, position_B_P, quat_B_P, q, aperture_m))


def joints(stamps_ns: Stamps, q: Array, dq: Array) -> list[bytes]:
    """Return foxglove.JointStates of (n, dof) rad and rad/s; joints are named joint1, joint2, ..."""
    each = ",".join(f'{{"name":"joint{i + 1}","position":%.6f,"velocity":%.5f}}' for i in range(q.shape[1]))
    table = np.stack([q, dq], axis=2)
    return _rows(f'{{"timestamp":{_TIME},"joints":[{each}]}}', stamps_ns, table)


def gripper(stamps_ns: Stamps, aperture_m: Array, force_N: Array, moving: Array) -> list[bytes]:
    """Return glotouch.Gripper of the jaws' last report: (n,) each; `moving` is 0 or 1."""
    return _rows(
        f'{{"timestamp":{_TIME},"aperture_m":%.6f,"force_N":%.3f,"moving":%d}}', stamps_ns, aperture_m, force_N, moving
    )


def depth_image(stamp_ns: int, frame_id: str, depth_m: Array) -> bytes:
    """Return foxglove.RawImage, 32FC1, of one depth map in m, rounded to 1e-6 m."""
    rows, cols = depth_m.shape
    data = base64.b64encode(np.round(depth_m, 6).astype("<f4").tobytes()).decode()
    head = f'{{"timestamp":{_TIME},' % divmod(stamp_ns, 10**9)
    return (
        f'{head}"frame_id":"{frame_id}","width":{cols},"height":{rows},"encoding":"32FC1","step":{4 * cols},'
        f'"data":"{data}"}}'
    ).encode()
