"""Files that others made: read through bounds on their size, their nesting and their numbers."""
