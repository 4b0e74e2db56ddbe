"""Values of a target's tables at the places of closures, between cells or at the nearest ones."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.recognition.model import Array32, TargetModel
from glotouch_bt.robot import Array

Index = npt.NDArray[np.int64]


def interpolated_widths(model: TargetModel, l_m: Array, z_m: Array, turn_rad: Array) -> Array32:
    """Return predicted widths (n, nz, nl, 72) of n layers, at yaws phi + turn.

    NaN for empty windows and outside the table.

    Args:
        model: The target.
        l_m, z_m: (n, nl) and (n, nz) places of each layer.
        turn_rad: (n,) turns.
    """
    roll = turn_rad / (2 * np.pi) * len(model.phi_rad)
    whole = np.floor(roll + 1e-6).astype(np.int64)
    part = (roll - whole).astype(np.float32)
    part[part < 1e-3] = 0
    (i, f), (j, g) = positions(model.l_m, l_m), positions(model.z_m, z_m)
    out = interpolated(model.width_m.transpose(2, 1, 0)[None], i, f, j, g, whole % len(model.phi_rad), part)
    out.transpose(0, 2, 1, 3)[(l_m < model.l_m[0]) | (l_m > model.l_m[-1])] = np.nan
    out[(z_m < model.z_m[0] - 5e-3) | (z_m > model.z_m[-1])] = np.nan
    return out


@compiled(
    "given f4[:, :, :, ::1]",
    "given i8[:, ::1]",
    "given f4[:, ::1]",
    "given i8[:, ::1]",
    "given f4[:, ::1]",
    "given i8[::1]",
    "given f4[::1]",
)
def interpolated(tables: Array32, i: Index, f: Array32, j: Index, g: Array32, rolls: Index, parts: Array32) -> Array32:
    """Return values (n, nz, nl, 72) between the cells of tables, linearly along shift, height and yaw.

    Args:
        tables: (n or 1, heights, shifts, 72): one for each result, or one for all.
        i, f: (n, nl) lower cells along the shifts, and fractions.
        j, g: (n, nz) lower cells along the heights, and fractions.
        rolls, parts: (n,) steps by which the yaws are larger, whole ones from 0 to 71 and a fraction of one.
    """
    n, nz, nl, yaws = len(i), j.shape[1], i.shape[1], tables.shape[3]
    out = np.zeros((n, nz, nl, yaws), dtype=np.float32)
    twice: Array32 = np.zeros(2 * yaws, dtype=np.float32)
    one = np.float32(1)
    for k in range(n):
        table, roll, part = tables[k % len(tables)], rolls[k], parts[k]
        here, beside = twice[roll : roll + yaws], twice[roll + 1 : roll + 1 + yaws]
        for z in range(nz):
            low, high, up = table[j[k, z]], table[j[k, z] + 1], g[k, z]
            for x in range(nl):
                a, b, c, d = low[i[k, x]], low[i[k, x] + 1], high[i[k, x]], high[i[k, x] + 1]
                on = f[k, x]
                for y in range(yaws):
                    twice[y] = (a[y] * (one - on) + b[y] * on) * (one - up) + (c[y] * (one - on) + d[y] * on) * up
                twice[yaws:] = twice[:yaws]
                turned = out[k, z, x]
                if part == 0:
                    turned[:] = here
                else:
                    for y in range(yaws):
                        turned[y] = (one - part) * here[y] + part * beside[y]
    return out


def nearest(table: Array32, model: TargetModel, l_m: Array, z_m: Array, turn_rad: Array) -> Array32:
    """Return the values (n, nz, nl, 72) of the nearest cells of a table of a model, at yaws phi + turn.

    `l_m` (n, nl), `z_m` (n, nz) and `turn_rad` (n,) are the places of n layers.
    """
    yaws = len(model.phi_rad)
    (i, f), (j, g) = positions(model.l_m, l_m), positions(model.z_m, z_m)
    turn = np.rint(turn_rad / (2 * np.pi) * yaws).astype(np.int64) % yaws
    still = np.zeros(len(l_m), dtype=np.float32)
    by_place = np.ascontiguousarray(table.transpose(2, 1, 0))[None]
    return interpolated(by_place, i, np.rint(f), j, np.rint(g), turn, still)


def positions(axis: Array, x: Array) -> tuple[Index, Array32]:
    """Return lower cell and fraction of each x, clamped to the axis."""
    last = len(axis) - 1
    t = np.minimum(np.maximum((x - axis[0]) * (last / (axis[-1] - axis[0])), 0.0), last - 1e-9)
    i = t.astype(np.int64)  # floor, because t is not negative
    return i, (t - i).astype(np.float32)
