"""The message bus: the rate of committed deltas, and the messages lost."""
