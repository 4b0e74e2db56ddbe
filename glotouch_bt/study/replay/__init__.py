"""A run done again from its record, without a robot: every fit, match and decision of it, beside what it was then."""
