"""The commands behind `glotouch`, one file each, and what they print."""
