"""The tree panel: what runs is unfolded, the rest is one line."""

from __future__ import annotations

from glotouch_bt.report.state import TreeRow, tree_rows

NODES = {
    "m/top": "RUNNING",
    "m/top/find": "SUCCESS",
    "m/top/find/sweep": "SUCCESS",
    "m/top/find/orbit": "FAILURE",
    "m/top/take": "RUNNING",
    "m/top/take/retry": "RUNNING",
    "m/top/take/retry/grasp": "RUNNING",
    "m/top/take/retry/old": "INVALID",
}


def test_the_running_branch_is_unfolded() -> None:
    assert tree_rows(NODES) == [
        TreeRow("top", "top", 0, "RUNNING"),
        TreeRow("find", "find", 1, "SUCCESS", folded=2),
        TreeRow("take › retry", "take › retry", 1, "RUNNING"),
        TreeRow("grasp", "grasp", 2, "RUNNING"),
        TreeRow("old", "old", 2, "INVALID"),
    ]


def test_a_failed_tree_shows_where() -> None:
    ended = {n: "FAILURE" if s == "RUNNING" else s for n, s in NODES.items()}
    assert [(r.label, r.folded) for r in tree_rows(ended)] == [
        ("top", 0), ("find", 0), ("sweep", 0), ("orbit", 0), ("take › retry", 0), ("grasp", 0), ("old", 0),
    ]  # fmt: skip


def test_everything_can_be_unfolded() -> None:
    assert sum(r.folded for r in tree_rows(NODES, whole=True)) == 0
    assert [r.label for r in tree_rows(NODES, whole=True)] == [
        "top", "find", "sweep", "orbit", "take › retry", "grasp", "old",
    ]  # fmt: skip


def test_a_long_chain_shows_its_ends() -> None:
    chain = {"m/" + "/".join("abcd"[: i + 1]): "RUNNING" for i in range(4)}
    assert tree_rows(chain) == [TreeRow("a › … › d", "a › b › c › d", 0, "RUNNING")]
