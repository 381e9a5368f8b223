"""A real system of processes that is attacked while it drives, and how it is watched meanwhile."""
