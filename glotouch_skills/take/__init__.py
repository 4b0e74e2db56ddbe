"""Skills that grasp the target, lift it, check it, and put it back."""
