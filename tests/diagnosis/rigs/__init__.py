"""Rigs that were not there when the diagnosis was tuned: another simulator, other machines, each written down in more than one way.

Half of the rigs are for calibrating, the other half only for being asked. ``python -m tests.diagnosis.rigs`` prints the table for both.
"""
