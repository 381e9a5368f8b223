"""Routes: on grids against exact search, and tours past several goals against people."""
