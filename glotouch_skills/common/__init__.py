"""Motions and plans that several skills share, in one folder a topic; no skill is registered from here."""
