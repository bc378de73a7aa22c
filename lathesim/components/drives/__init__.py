"""Amplifiers, and what all motors have in common."""
