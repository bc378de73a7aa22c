"""Watermarks on a reference, and guards that tell forged readings by them."""
