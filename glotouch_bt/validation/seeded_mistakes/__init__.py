"""TODO door of glotouch_bt/validation/seeded_mistakes."""

from glotouch_bt.validation.seeded_mistakes.bench import as_markdown, compare, summary

__all__ = ["as_markdown", "compare", "summary"]
