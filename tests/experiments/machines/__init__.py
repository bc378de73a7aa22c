"""Machines of other structures than the emulator's, made by a generator of their own, and emulated from their way-points."""
