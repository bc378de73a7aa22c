"""Commands: part programs."""
