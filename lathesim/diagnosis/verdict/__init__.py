"""Ranking of what was found, tests of what is left, and the decision."""
