"""Whether a recording is at fault: each check is one file."""
