"""Receptance coupling: beams and joints to the tip of an assembly."""
