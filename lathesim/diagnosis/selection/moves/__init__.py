"""Moves of the search: each proposes a change of the model that was found."""
