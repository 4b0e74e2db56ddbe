"""The clock of the page."""

from __future__ import annotations

from glotouch_bt.report.state import Player

SPAN = (0.0, 20.0)


def test_a_live_view_catches_up_and_stands_at_the_end() -> None:
    player = Player(live=True)
    shown = [player.advance(0.1, (0.0, 10.0), growing=True) for _ in range(40)]
    assert shown[0] == 10.0 or shown == sorted(shown)
    player.advance(0.1, (0.0, 12.0), growing=True)
    assert 10.0 < player.t_s < 12.0  # it moves, it does not jump
    for _ in range(40):
        player.advance(0.1, (0.0, 12.0), growing=False)
    assert player.t_s == 12.0
    assert not player.live


def test_play_speed_and_end() -> None:
    player = Player(live=False)
    player.seek(5.0)
    assert player.advance(1.0, SPAN, growing=False) == 5.0
    player.toggle(SPAN)
    player.set_speed(2.0)
    assert player.advance(1.5, SPAN, growing=False) == 8.0
    player.toggle(SPAN)
    assert player.advance(1.5, SPAN, growing=False) == 8.0
    player.toggle(SPAN)
    assert player.advance(99.0, SPAN, growing=False) == 20.0
    assert not player.playing
    player.toggle(SPAN)  # at the end it starts again
    assert player.advance(0.5, SPAN, growing=False) == 1.0


def test_playing_to_the_end_of_a_run_under_way_follows_it() -> None:
    player = Player(live=False)
    player.seek(19.0)
    player.toggle(SPAN)
    player.advance(5.0, SPAN, growing=True)
    assert player.live


def test_marks_and_jumps_stay_inside() -> None:
    player = Player(live=False)
    player.seek(10.0)
    assert player.to_mark([2.0, 9.0, 15.0], forward=False)
    assert player.t_s == 9.0
    assert player.to_mark([2.0, 9.0, 15.0], forward=True)
    assert player.t_s == 15.0
    assert not player.to_mark([2.0, 9.0, 15.0], forward=True)
    player.jump(-50.0)
    assert player.advance(0.1, SPAN, growing=True) == 0.0
