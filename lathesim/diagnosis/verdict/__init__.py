"""Ranking of what was found, the doubt about what is left, and the verdict."""
