"""Readers of a user's own files: what others recorded or surveyed, with clear errors for a wrong
line.
"""
