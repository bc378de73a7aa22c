"""File formats, one reader a file, and what they share."""
