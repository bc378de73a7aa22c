"""Which effects may explain what is missing, from which starting points, in which order."""
