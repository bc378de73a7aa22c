"""Screens, one a file; ``app`` imports each when it is first shown."""
