"""Nose compensation: tools with their nose radius and orientation, and the path of the tool point that leaves the programmed contour."""
