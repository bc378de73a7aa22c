"""Effects of the catalogue, placed in a machine."""
