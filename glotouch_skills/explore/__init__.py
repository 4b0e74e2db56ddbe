"""Skills that search the container by touch and trace what they find."""
