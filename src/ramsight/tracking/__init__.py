"""A log followed by a sensor: the track piece by piece, its statistics, and its errors against a true position."""
