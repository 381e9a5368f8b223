"""Loop closing (paper §5.6, figure 6): a path round some blocks, before and after correction."""
