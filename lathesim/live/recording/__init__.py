"""Record what a machine publishes."""
