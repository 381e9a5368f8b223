"""Route planning by activation that spreads over place networks (paper §5.5)."""
