"""Controllers of the cutting process: they choose the feed from the force."""
