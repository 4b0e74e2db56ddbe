"""`glotouch test`: outcome coverage of a mission's tests."""

from __future__ import annotations

from typing import Annotated

import typer

from glotouch_bt.commands.shared import MissionName, guarded, styled_streams


@guarded
def run_tests(
    mission: MissionName,
    tests: Annotated[list[str] | None, typer.Argument(metavar="TESTS", help="test files or folders")] = None,
    coverage: Annotated[
        float | None,
        typer.Option(
            "--coverage-min", min=0.0, max=100.0, metavar="PERCENT", help="fail if the tests exercise fewer outcomes"
        ),
    ] = None,
) -> int:
    """Run a mission's tests; report the outcomes they exercise.

    Lists the outcomes of each skill of the mission, and those that no test reaches.
    """
    from glotouch_bt.mission import load_mission
    from glotouch_bt.robot import BadInput

    try:
        import pytest
    except ImportError as e:
        raise BadInput(
            "glotouch test needs pytest, which is not installed here: pip install 'glotouch-bt[test]'"
        ) from e
    load_mission(mission)
    words = [*(tests or []), "-q", "-p", "no:cacheprovider", "--glotouch-coverage"]
    words += [] if coverage is None else ["--glotouch-coverage-min", str(coverage)]
    with styled_streams():  # pytest colours its own text
        code = int(pytest.main(words))
    if code == int(pytest.ExitCode.NO_TESTS_COLLECTED):
        raise BadInput(f"no tests in {', '.join(tests or ['this folder'])} (docs/tutorial.md shows how to write them)")
    return code if code in (0, 1) else 2
