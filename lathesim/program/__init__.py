"""From the text of a part program to moves and to the path the interpolator walks along."""
