"""GLoTouch-BT: a behavior-tree mission executive for robots that work by touch."""

__version__ = "0.1.0"
