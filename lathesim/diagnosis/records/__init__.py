"""The nouns of a diagnosis."""
