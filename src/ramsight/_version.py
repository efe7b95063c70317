"""The version of the package; the build reads it here, and nothing else is in this file."""

__version__ = "0.1.0"
