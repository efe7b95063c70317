"""Position, band, bound and status."""
