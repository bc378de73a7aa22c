"""References: where each axis shall be, from a part program or a recording."""
