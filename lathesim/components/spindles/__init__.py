"""Spindles: a command in, a speed and an angle out."""
