"""The cut: its geometry, force, load, wear, the stock and the surface that is left."""
