"""Compute, traffic and memory on maps of different sizes."""
