"""From a module to a Record: blocks, batches, noise, and what is said when a run breaks."""
