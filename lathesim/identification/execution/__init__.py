"""What a search may spend: threads, runs, time, and results that are kept."""
