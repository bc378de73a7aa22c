"""A closed machine learnt from way-points of its programs."""
