"""Signals that nobody recorded and that are added to a command on its way."""
