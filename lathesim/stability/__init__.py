"""Stability of cutting: modes of the tool point, limits of the chip width over speed, and receptances of coupled parts."""
