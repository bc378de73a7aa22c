"""Streams of twenty simulated minutes for the watch, from machines that share no code with the program."""
