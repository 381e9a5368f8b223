"""The experiments of the paper, through the same modules that drive the town."""
