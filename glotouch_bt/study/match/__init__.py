"""`bench match`: TouchSets recorded by the real skills, and how well matchers tell the target from them."""
