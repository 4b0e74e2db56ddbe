"""The executive's side of the driver: backend, robot, socket, driver process and drills. Imports no SDK."""

from glotouch_backends.flexiv_xense.client.backend import FlexivXenseBackend
