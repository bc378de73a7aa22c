"""Campaigns that measure the stability part on many cases, as commands; see ``python -m tests.stability.campaign --help``."""
