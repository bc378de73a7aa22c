"""Physics that a simulation may have left out, and what compensates it; each effect and each remedy is a component."""
