"""Machines and parts for other tools, and parts of other tools in a machine, by the Functional Mock-up Interface (FMI)."""
