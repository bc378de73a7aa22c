"""The turned part as a record tells it: its shape, its surface, its waves, or why there is none."""
