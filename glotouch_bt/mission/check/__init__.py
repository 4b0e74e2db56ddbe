"""The load-time check: from a read tree to findings, each with the shortest run that shows it. Knows no py_trees."""

from glotouch_bt.mission.check.rules import check_flow
