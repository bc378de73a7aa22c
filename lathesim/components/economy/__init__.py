"""What a lathe and a turned part cost."""
