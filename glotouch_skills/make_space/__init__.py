"""Skills that make space for the fingers: push an object aside, or lift it out and set it down elsewhere."""
