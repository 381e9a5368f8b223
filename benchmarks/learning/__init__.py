"""Learning from what is conscious: names that are expected, and surprises."""
