"""The version of this package, stated once for Python; package.xml repeats it, and a test compares them."""

__version__ = "0.1.0"
