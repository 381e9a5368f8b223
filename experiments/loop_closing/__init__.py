"""Loop closing (paper §5.6, figure 6): a way round some blocks, before and after it is corrected."""
