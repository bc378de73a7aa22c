"""Commands: contour control, learning and remedies."""
