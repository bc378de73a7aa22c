"""From the text of a module to machine code, and the cache of both."""
