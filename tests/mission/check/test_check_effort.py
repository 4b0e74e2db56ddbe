"""However many mistakes there are, the search for the runs that show them takes a bounded number of steps."""

from __future__ import annotations

from pathlib import Path

import pytest

from glotouch_bt.mission.check import rules as judge
from glotouch_bt.mission.check.counterexample import MAX_STEPS, StepBudget
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.spec.findings import MissionFaults

HEAD = """\
mission: m
world: worlds/container_five.yaml
tree:
  sequence:
    - subtree: {file: subtrees/probe_objects.yaml, ports: {candidates: candidates, found: found}}
"""


@pytest.mark.study
def test_forty_mistakes_behind_an_exploration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The probe is put back for ever: each time but the first it is wrong, and long after the start."""
    kept: list[StepBudget] = []

    class Kept(StepBudget):
        def __init__(self, steps: int = MAX_STEPS) -> None:
            super().__init__(steps)
            kept.append(self)

    monkeypatch.setattr(judge, "StepBudget", Kept)
    path = tmp_path / "m.yaml"
    path.write_text(HEAD + 40 * "    - tool_return\n")
    with pytest.raises(MissionFaults) as caught:
        load_mission(path)
    findings = [f for f in caught.value.findings if f.code == "wrong_state"]
    assert len(findings) == 40
    assert findings[0].path, "the first one is shown"
    _, patience = kept  # the first one, of no steps, belongs to the analysis that only looks for any mistake
    most_at_once = 1_000  # of the state being left when it ran out
    assert -most_at_once < patience.steps < MAX_STEPS
