"""Readers of recordings made elsewhere, and their alignment; each gives a Record."""
