"""Skills that make space for the fingers: push an object aside."""
