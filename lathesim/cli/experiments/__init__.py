"""Commands: closed controllers, designed programs, watermarks."""
