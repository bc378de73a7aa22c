"""Why an effect that was believed is refused after all."""
