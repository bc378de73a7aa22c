"""Paths of the axes in time: a spline through samples, its quickest timing within the limits of the axes, kinematics of machines."""
