"""The spikes of place cells as samples of the exact posterior (paper, figure 4)."""
