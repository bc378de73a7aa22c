"""Commands: the terminal app."""
