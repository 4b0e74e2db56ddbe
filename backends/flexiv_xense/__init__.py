"""Robot over the vendors' SDKs, which live in a driver process of their own. See `backend` and docs/hardware.md."""

from backends.flexiv_xense.backend import FlexivXenseBackend

__all__ = ["FlexivXenseBackend"]
