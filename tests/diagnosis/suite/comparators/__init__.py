"""Other ways to answer the same cases, written anew: what a person would try without the program. They see lesson and recordings only."""
