"""Days of driving in a town that is long known: what they cost, and whether the map stays."""
