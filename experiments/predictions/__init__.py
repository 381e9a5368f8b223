"""Predictions of place cells (paper §5.6): from a drive's log, and in recordings of cells."""
