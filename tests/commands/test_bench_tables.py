"""The tables that benches print at their end."""

from pathlib import Path

import pytest

from glotouch_bt.commands.terminal.bench_tables import print_growth


def test_growth_prints_its_points(capsys: pytest.CaptureFixture[str]) -> None:
    mean = {"mean": 2.5, "lo": 2.0, "hi": 3.0, "n": 10}
    point = {
        "objects": 5, "area": 2.0, "complete": 1.0, "travel_m": mean, "contacts": mean, "planning_s": mean,
        "plan_s": 0.04, "longest_plan_s": 0.2,
    }  # fmt: skip
    slopes = {"travel_m": {"objects": 0.4, "area": 0.6}}
    summary = {"policy": "expected_find", "seeds": [1, 2], "points": [point], "slopes": slopes}
    print_growth(summary, Path("out"))
    shown = capsys.readouterr()
    assert "growth of travel" in shown.out + shown.err
