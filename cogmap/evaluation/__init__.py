"""Compares where an agent believed to be with where its robot truly was."""
