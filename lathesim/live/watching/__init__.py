"""A diagnosis that runs with the machine."""
