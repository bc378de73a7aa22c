"""Guards against forged measurements."""
