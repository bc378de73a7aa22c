"""Concealed cases for the diagnosis: recordings of three rigs with known hidden physics, and the runner that scores the answers.

The simulators of the truth share no code with the package under test: they are fine-step loops of their own (20 us, implicit Coulomb
friction, exact lags), in other forms than the catalogue's. ``python -m tests.diagnosis.suite --help`` says how to run it.
"""
