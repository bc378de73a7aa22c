"""Sampled signals: size, delay, steps, resolution, lines of a spectrum."""
