"""Timed samples from wherever they come, and where they go."""
