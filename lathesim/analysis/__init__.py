"""What is read off a Record: metrics, figures, files for other programs."""
