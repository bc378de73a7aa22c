"""What to run next, and what was learnt: emulation of closed controllers, designed programs, watermarks."""
