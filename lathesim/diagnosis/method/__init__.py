"""The limits of the method, each with its unit, meaning, basis and evidence; :class:`Method` holds them all and is passed down."""

from lathesim.diagnosis.method.method import STANDARD, Method
from lathesim.limit import Limit

__all__ = ["STANDARD", "Limit", "Method"]
