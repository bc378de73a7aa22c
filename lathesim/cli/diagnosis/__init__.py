"""Commands: recordings against simulations."""
