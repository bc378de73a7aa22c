"""Learning from lap to lap: what is added to a lap so that the next one is better."""
