"""Where the piston of a hydraulic cylinder is, without a position sensor."""

__version__ = "0.1.0.dev0"
