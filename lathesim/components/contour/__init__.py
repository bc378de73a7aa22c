"""Parts that keep the tool on its contour: references, foot points, contour controllers."""
