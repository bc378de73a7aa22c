"""Wiring of parts, fusing of their laws into one module, time stepping and batches."""
