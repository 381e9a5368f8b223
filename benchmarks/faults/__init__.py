"""Kills processes of real drives at any time, and looks for what that lost."""
