"""What is told about a program: its blocks in words, what is odd in it, and whether it meets the stock."""
