"""The command line: one verb a function, nothing else. Whatever a verb needs is imported inside it."""

from ramsight.cli.verbs import app, main

__all__ = ["app", "main"]
