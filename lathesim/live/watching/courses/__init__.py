"""How a value, a size or a channel goes on in time, and when it meets a tolerance."""
