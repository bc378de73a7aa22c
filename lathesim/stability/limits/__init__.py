"""Limits of the chip width, by three methods that share no code."""
