"""Skills of the hand and the wrist sensor: take, measure, check and put away the probe."""
