"""A class: a machine of their own for each student, grades of what all hand in, and what only the teacher has."""
