"""Sub-maps of real cities (paper §5.3)."""
