"""Stored answers: cases whose whole answer is kept, so that a change of the program that should change none can be proved to change none.

``python -m tests.diagnosis.stored`` compares every answer bit for bit; ``--write`` stores them anew. The recordings are not kept: the
generators make them again from their seeds.
"""
