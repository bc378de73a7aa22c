"""Around the reading of a program: sentences for what is no word, controls that are not supported, which dialect it is."""
