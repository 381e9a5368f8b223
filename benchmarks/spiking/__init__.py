"""How well the spikes of place cells are samples of the exact posterior (paper, figure 4)."""
