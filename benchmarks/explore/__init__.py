"""Exploration of towns, and drives to goals in them, judged by the truth."""
