"""A press from its first sample to how it was left."""
