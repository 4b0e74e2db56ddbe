"""Skills that make space for the fingers: push an object, or lift one out and set it down elsewhere."""
