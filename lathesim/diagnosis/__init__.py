"""When simulation and recording differ: locate it, name it, model it, show the fit improve."""
