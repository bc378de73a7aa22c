"""The search: forward selection, moves on what was selected, and when a model is accepted."""
