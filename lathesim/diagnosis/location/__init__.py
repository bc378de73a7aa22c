"""What is missing, where it acts, and what it depends on."""
