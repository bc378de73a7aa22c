"""What a person reads about the program: the pages of components and effects, made from their declarations."""
