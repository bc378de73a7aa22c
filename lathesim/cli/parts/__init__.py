"""Commands: what a machine is made of."""
