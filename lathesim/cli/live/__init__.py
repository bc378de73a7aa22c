"""Commands: machines that run."""
