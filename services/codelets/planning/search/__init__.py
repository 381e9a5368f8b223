"""Routes over one network that changes: exact, or on a hierarchy of its levels."""
