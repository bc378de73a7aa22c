"""Faults of a recording that show in itself, without any simulation."""
