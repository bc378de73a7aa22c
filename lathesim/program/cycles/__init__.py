"""Canned cycles of lathes: each a function from a few numbers to the moves it stands for."""
