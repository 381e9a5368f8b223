"""Bayesian localization by spikes (paper §5.4, figure 4; Madl et al. 2014): cells as generators of
spikes, and their coincidences.
"""
