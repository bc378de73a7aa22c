"""Figures: the only files outside the diagnosis that draw with matplotlib."""
