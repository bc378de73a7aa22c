"""Exercises for a class: hide physics in a lesson, seal the answer, grade what was found."""
