"""A local dask cluster makes the same rows as local workers, and survives trials that kill their processes."""

from __future__ import annotations

from pathlib import Path

import pytest

from glotouch_bt.campaign import ClusterPool, WorkerPool
from glotouch_bt.robot import BadInput
from tests.support.short_trials import run_short, short_campaign, short_trials

KINDS = {1: "kill", 2: "kill once", 3: "raise", 4: "hang"}


@pytest.mark.study
@pytest.mark.filterwarnings("ignore")
def test_a_local_cluster_gives_the_same_rows(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    for name, kind in (("workers", WorkerPool), ("cluster", ClusterPool)):
        given = (2,) if kind is WorkerPool else ("local", 2)
        campaign = short_campaign(tmp_path / name)
        with kind(*given, limit_s=1.0) as pool:
            run_short(campaign, pool, short_trials(campaign, 8, 10, KINDS))
    tables = [(tmp_path / name / "trials.csv").read_text() for name in ("workers", "cluster")]
    assert tables[0] == tables[1]
    assert "1,,,lost,lost: its process was killed (SIGKILL)" in tables[1]
    assert "4,,,lost,lost: it hung: no result after 1 s" in tables[1]


def test_no_scheduler_is_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("glotouch_bt.campaign.cluster.CONNECT_S", 0.3)
    with pytest.raises(BadInput, match=r"--cluster tcp://127.0.0.1:9: no scheduler answers"):
        ClusterPool("tcp://127.0.0.1:9", 1)


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(BadInput, match=r"pip install 'glotouch-bt\[cluster\]'"):
        ClusterPool("local", 1)
