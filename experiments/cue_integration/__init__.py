"""Experiment 1 of the paper (§6.1, figure 7): how self-motion and landmarks are combined, after Nardini et al. (2008)."""
