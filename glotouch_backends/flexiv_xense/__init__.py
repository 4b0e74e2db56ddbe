"""Backend over the vendors' SDKs, which run in a separate driver process. See docs/guides/hardware.md.

The backend is loaded on first use: the driver, which is inside this package, starts without it.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from glotouch_backends.flexiv_xense.client import FlexivXenseBackend as FlexivXenseBackend


def __getattr__(name: str) -> Any:
    if name != "FlexivXenseBackend":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from glotouch_backends.flexiv_xense.client import FlexivXenseBackend

    return FlexivXenseBackend
