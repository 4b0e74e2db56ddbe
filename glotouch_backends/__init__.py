"""Backends: one package each, found through entry points."""
