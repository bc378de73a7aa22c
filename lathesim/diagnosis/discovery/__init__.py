"""A formula for what no effect of the catalogue explains."""
