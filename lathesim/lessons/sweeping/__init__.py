"""Sweeps: one lesson run over ranges of its parameters."""
