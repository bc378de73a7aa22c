"""The engine of ``lathesim compare``: a recording beside the simulation of a lesson."""
