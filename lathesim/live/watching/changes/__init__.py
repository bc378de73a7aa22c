"""Whether and when what is left out changed."""
