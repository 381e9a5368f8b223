"""Perception by the modules of the running system, of held-out towns and of photographs."""
