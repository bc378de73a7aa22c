"""Feed axes: a command in, a position out."""
