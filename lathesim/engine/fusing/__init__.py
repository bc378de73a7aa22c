"""From a plan to the text of one module: the laws fused, and rewritten for plain Python."""
