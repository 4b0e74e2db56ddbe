"""What touch tells: contacts and outlines (touch), where to probe next (search), which object it is (recognition)."""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door

if TYPE_CHECKING:
    from glotouch_bt.perception.model_cache import target_model

__getattr__ = lazy_door(__name__, target_model="model_cache")

__all__ = ["target_model"]
