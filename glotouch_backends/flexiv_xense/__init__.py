"""Robot over the vendors' SDKs, which live in a driver process of their own. See `backend` and docs/hardware.md."""

from glotouch_backends.flexiv_xense.client import FlexivXenseBackend

__all__ = ["FlexivXenseBackend"]
