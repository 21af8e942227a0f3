"""The version of the project."""

__version__ = "1.0.0"
