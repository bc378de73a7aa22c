"""Physics that a simulation may have left out, one family a file; every effect is a component."""
