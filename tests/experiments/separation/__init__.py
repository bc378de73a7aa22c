"""Sealed cases of tied effects, told apart by the program that ``lathesim experiment`` writes."""
