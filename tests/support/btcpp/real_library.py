"""Load trees in the real BehaviorTree.CPP: `python real_library.py TREES.json RESULTS.json`, in its own environment.

Each tree has its `xml`, the `board` (values by key) and `tick` (run it once). Each result is the `error` of the library
or the `status`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from behaviortreepy import BehaviorTreeFactory, Blackboard


def result(tree: dict) -> dict:
    board = Blackboard.create()
    setters = {bool: board.set_bool, int: board.set_int, float: board.set_double, str: board.set_string}
    for key, value in tree.get("board", {}).items():
        setters[type(value)](key, value)
    try:
        made = BehaviorTreeFactory().create_tree_from_text(tree["xml"], board)
        return {"status": made.tick_once().name if tree.get("tick") else "loaded"}
    except RuntimeError as e:
        return {"error": str(e)}


if __name__ == "__main__":
    trees, results = map(Path, sys.argv[1:])
    results.write_text(json.dumps([result(t) for t in json.loads(trees.read_text())]))
