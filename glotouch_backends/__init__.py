"""Backends, one package each, registered as entry points; and the robot description that they share."""
