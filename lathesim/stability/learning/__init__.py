"""What cuts teach: distributions of the parameters, and the next cut worth making."""
