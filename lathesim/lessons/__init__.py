"""Lessons and machine templates: from YAML text to a run and a grade."""
