"""Chatter told from other vibration in a recording."""
