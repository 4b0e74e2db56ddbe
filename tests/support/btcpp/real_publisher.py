"""The publisher of the real BehaviorTree.CPP: `python real_publisher.py TREE.xml PORT` serves it until stdin ends.

Every line on stdin ticks the tree once, and is answered by one line.
"""

from __future__ import annotations

import sys
from pathlib import Path

from behaviortreepy import BehaviorTreeFactory, Blackboard, Groot2Publisher

if __name__ == "__main__":
    board = Blackboard.create()
    board.set_int("found", 3)
    tree = BehaviorTreeFactory().create_tree_from_text(Path(sys.argv[1]).read_text(), board)
    publisher = Groot2Publisher(tree, int(sys.argv[2]))
    print("ready", flush=True)
    for _ in sys.stdin:
        print(tree.tick_once().name, flush=True)
