"""Backend over the vendors' SDKs, which run in a separate driver process. See docs/guides/hardware.md."""

from glotouch_backends.flexiv_xense.client import FlexivXenseBackend
