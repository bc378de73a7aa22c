"""From the name of an effect to its compensation: trained regulators, learning from lap to lap, remedies, the circular test."""
