"""Showcases: the demonstration that ships with the package, and a loader at work as a film."""
