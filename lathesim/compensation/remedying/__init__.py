"""From a diagnosis to its compensation: chosen, sized, tried by simulation, promised, written."""
