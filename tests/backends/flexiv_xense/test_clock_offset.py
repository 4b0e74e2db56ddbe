"""A device's stamps give the time of a reading, independent of its delay."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.driver.clock_offset import StampConverter


def stamped(made_s: float, drift: float = 0.0) -> tuple[int, int]:
    whole = round((1_700_000_000.0 * 1e9) + made_s * (1.0 + drift) * 1e9)
    return divmod(whole, 1_000_000_000)


@pytest.mark.parametrize("drift", [0.0, 5e-5, -5e-5])
def test_transport_jitter_is_removed(drift: float) -> None:
    """After the first window the times differ from the true ones by the smallest delay, 0.2 ms."""
    rng = np.random.default_rng(0)
    convert, off, now = StampConverter(), [], 0.0
    for k in range(20_000):
        made = 1e-3 * k
        now = max(now, made + 0.0002 + rng.exponential(0.002))
        date = convert(stamped(made, drift), now)
        assert date <= now + 2e-6
        off.append(date - made - 0.0002)
    assert np.abs(off[2000:]).max() < 3e-4, "ms jitter, and the drift of a second"
    assert np.diff(np.array(off) + 1e-3 * np.arange(20_000)).min() > 0


def test_a_jump_of_the_offset_is_followed() -> None:
    convert = StampConverter()
    for k in range(3000):
        convert(stamped(1e-3 * k), 1e-3 * k)
    late = [convert(stamped(1e-3 * k), 1e-3 * k + 0.08) - (1e-3 * k + 0.08) for k in range(3000, 6000)]
    assert late[0] == pytest.approx(-0.08, abs=1e-6)
    assert late[-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("stamp", [None, 3.5, "x", (1, 2, 3), (1.0, 2)])
def test_without_a_stamp_the_arrival_time_counts(stamp: object) -> None:
    assert StampConverter()(stamp, 12.5) == 12.5
