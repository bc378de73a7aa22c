"""Neural regulators: weights as numbers, the score, and the searches for them."""
