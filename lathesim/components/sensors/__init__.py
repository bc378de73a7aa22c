"""Sensors: what a controller or a recorder sees of a quantity."""
