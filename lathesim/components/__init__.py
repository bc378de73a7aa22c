"""The stock machine parts, one a file."""
