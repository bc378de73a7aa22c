"""Commands: run lessons, grade, sweep, plot, export."""
