"""Robot over the vendors' SDKs, which run in a driver process. See `backend` and docs/guides/hardware.md."""

from glotouch_backends.flexiv_xense.client import FlexivXenseBackend

__all__ = ["FlexivXenseBackend"]
