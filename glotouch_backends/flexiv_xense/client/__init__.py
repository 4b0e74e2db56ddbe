"""TODO door of glotouch_backends/flexiv_xense/client."""

from glotouch_backends.flexiv_xense.client.backend import FlexivXenseBackend

__all__ = ["FlexivXenseBackend"]
