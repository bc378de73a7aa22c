"""The effects that are known of a machine, and their sizes."""
