"""The robots that ship with the project, each as a URDF and a YAML file; and robots by name or path."""

from glotouch_backends.robots.load import load_robot, shipped_robots
