"""Converters between numbers and voltages."""
