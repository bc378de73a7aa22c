"""The tool point: its modes, its measured response, and the tap test that finds them."""
