from __future__ import annotations


def dataset() -> None:
    """x"""
