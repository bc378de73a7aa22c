"""The next part program, chosen by what it is expected to tell."""
