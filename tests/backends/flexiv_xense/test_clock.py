"""The stepped clock: which thread advances the world, and in which order."""

from __future__ import annotations

import pytest

from glotouch_backends.flexiv_xense.driver.clock import SteppedClock, WallClock


def test_without_a_conductor_the_sleeper_advances_the_world() -> None:
    went: list[float] = []
    clock = SteppedClock(went.append)
    clock.sleep_until(0.5)
    clock.sleep_until(0.2)
    assert went == [0.5]
    assert clock.now_s() == 0.5


def test_workers_wake_at_their_times_in_order() -> None:
    clock = SteppedClock(lambda stamp_s: None)
    seen: list[tuple[str, float]] = []

    def worker(name: str, step_s: float) -> None:
        for k in range(1, 4):
            clock.sleep_until(k * step_s)
            seen.append((name, clock.now_s()))

    with clock.conducting():
        clock.spawn(lambda: worker("a", 0.25))
        clock.spawn(lambda: worker("b", 0.375))
        assert seen == []
        for k in range(1, 11):
            clock.sleep_until(0.125 * k)
    names = [name for name, _ in seen]
    assert names == ["a", "b", "a", "b", "a", "b"]  # at 0.75, b went to sleep first
    assert [t for _, t in seen] == pytest.approx([0.25, 0.375, 0.5, 0.75, 0.75, 1.125])


def test_a_worker_that_outlives_the_conductor_never_advances_the_world() -> None:
    clock = SteppedClock(lambda stamp_s: None)
    seen: list[float] = []

    def worker() -> None:
        while True:
            clock.sleep_until(clock.now_s() + 0.1)
            seen.append(clock.now_s())

    with clock.conducting():
        clock.spawn(worker)
        clock.sleep_until(0.25)
    clock.sleep_until(0.45)
    assert clock.now_s() == 0.45
    assert seen == pytest.approx([0.1, 0.2, 0.3, 0.4])


def test_work_spawned_without_a_conductor_runs_at_once() -> None:
    clock = SteppedClock(lambda stamp_s: None)
    done: list[int] = []
    clock.spawn(lambda: done.append(1))
    assert done == [1]


def test_the_wall_clock_sleeps() -> None:
    clock = WallClock()
    begin = clock.now_s()
    clock.sleep_until(begin + 0.01)
    assert clock.now_s() >= begin + 0.0099
    clock.sleep_until(begin)
