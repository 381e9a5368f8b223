"""Experiment 1 of the paper (§6.1, figure 7): self-motion and landmarks combined, after Nardini et
al. (2008).
"""
