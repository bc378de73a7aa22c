"""Columns that the lesson maps to another place than they are of."""
