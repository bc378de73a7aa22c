"""Recordings of real machines, and eight of another author's simulator, asked as a person asks: right, partly or wrong in one table."""
