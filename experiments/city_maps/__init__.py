"""Experiment 2 of the paper (§6.2, figure 8): how accurate the maps are that an agent learns of
cities.
"""
