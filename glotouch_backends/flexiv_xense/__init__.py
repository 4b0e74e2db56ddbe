"""Backend over the vendors' SDKs, which run in a separate driver process. See docs/guides/hardware.md.

The backend is loaded on first use: the driver, which is inside this package, starts without it.
"""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door

if TYPE_CHECKING:
    from glotouch_backends.flexiv_xense.client import FlexivXenseBackend as FlexivXenseBackend

__getattr__ = lazy_door(__name__, FlexivXenseBackend="client")
