"""The driver: a small process that holds the vendors' SDKs, and stops the arm whatever happens to its client.

Stands alone on Python 3.10 (numpy, pyzmq, msgspec and the SDKs), where it is installed as `glotouch_driver`; imports
nothing of the rest of the project. `messages` is what it shares with its client.
"""
