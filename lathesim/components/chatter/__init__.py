"""Cuts that can chatter, the modes that swing, and the hammer that taps them."""
