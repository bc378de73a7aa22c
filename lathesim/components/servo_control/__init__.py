"""Controllers of axes and spindles, and the contour error that couples them."""
