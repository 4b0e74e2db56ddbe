"""Skills that squeeze what was found and decide which candidate is the target."""
