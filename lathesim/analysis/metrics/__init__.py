"""Metrics: a record in, a number in SI out."""
