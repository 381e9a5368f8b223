"""Cue integration by spikes (paper §5.4, figure 4; Madl et al. 2014): one posterior in a room, and
the recursion along a walk through it.
"""
