"""Experiment 3 (paper §5.5, figure 5): several goals in order, by people and by the model."""
