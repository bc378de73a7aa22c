"""What the terminal UI knows: the setup on the bench, its runs, a student's progress. Nothing here imports Textual."""
