"""lathesim: an educational, modular machine-tool simulator that says what physics a simulation left out."""

__version__ = "0.1.0"
