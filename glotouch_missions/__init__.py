"""Missions, worlds, conditions and object meshes that ship with the project (package data)."""
