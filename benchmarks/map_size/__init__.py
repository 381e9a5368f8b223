"""How compute, traffic and memory depend on the size of the map."""
