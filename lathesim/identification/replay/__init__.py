"""Recordings and the simulators that follow them: open loop along the measured motion, closed loop as the lesson runs."""
