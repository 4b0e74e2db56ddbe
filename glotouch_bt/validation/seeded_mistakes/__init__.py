"""`bench check`: seeded mistakes in missions, found by `glotouch check` and by py_trees."""

from glotouch_bt.validation.seeded_mistakes.bench import as_markdown, compare, summary
