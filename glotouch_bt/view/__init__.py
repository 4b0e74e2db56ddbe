"""The page that shows a mission while it runs and afterwards: `run --live` and `view`. It needs viser."""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door

if TYPE_CHECKING:
    from glotouch_bt.view.live import LiveView
    from glotouch_bt.view.serve import view_run

__getattr__ = lazy_door(__name__, LiveView="live", view_run="serve")
