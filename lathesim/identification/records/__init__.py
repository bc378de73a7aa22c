"""The nouns of identification: a candidate, free parameters and their fit, a model of a recording."""
