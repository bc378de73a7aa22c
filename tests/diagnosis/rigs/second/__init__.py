"""A second set of rigs, of other kinds than the first; nothing of the diagnosis was chosen on them when they were written."""
