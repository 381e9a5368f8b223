"""Messages and files changed at random, through every decoder, every handler and every reader."""
