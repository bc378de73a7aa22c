"""What holds for all tests: generated cases are the same in every run, and no verdict hangs on how fast the machine is."""

from hypothesis import HealthCheck, settings

settings.register_profile("lathesim", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("lathesim")
