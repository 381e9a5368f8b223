"""Cue integration by spikes (paper §5.4, figure 4; Madl et al. 2014): grid and border cells, and
coincidence.
"""
