"""TODO door of glotouch_bt/perception."""

from glotouch_bt.perception.model_cache import target_model

__all__ = ["target_model"]
