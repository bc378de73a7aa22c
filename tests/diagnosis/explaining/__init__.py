"""Tests of how explanations are found and compared."""
