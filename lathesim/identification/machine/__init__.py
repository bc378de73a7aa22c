"""What the parts of a machine are for."""
