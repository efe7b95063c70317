"""Published figures of position sensors that are built into cylinders, to lay a sheet beside.

Each is for a nominal length of 500 mm; where a sheet gives "whichever is greater", that one.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """What a maker says of a sensor; text, because each says it in his own way.

    Args:
        name: of the sensor.
        figures: by term.
        source: where it is said.
    """

    name: str
    figures: dict[str, str]
    source: str


PUBLISHED = (
    Published(
        "Temposonics R-Series RH, SSI",
        {
            "non-linearity": "±0.05 mm (0.01 %)",
            "hysteresis": "0.004 mm",
            "non-repeatability": "±0.005 mm (0.001 %)",
            "resolution": "0.002 mm",
            "time to first position": "at once, absolute",
            "drift without reference": "none, absolute",
        },
        "MTS Systems, Temposonics R Series, synchronous serial interface, product specifications",
    ),
    Published(
        "Balluff BTL5-P/I/L/M1, rod",
        {
            "non-linearity": "±0.1 mm",
            "hysteresis": "0.004 mm",
            "non-repeatability": "±0.002 mm, typical",
            "temperature drift": "0.0175 mm/K (35 ppm/K)",
            "resolution": "0.002 mm",
            "time to first position": "at once, absolute",
            "drift without reference": "none, absolute",
        },
        "Balluff, BTL5-P/I/L/M1-M-H/W(8)-S, user's guide, 6.1",
    ),
    Published(
        "Balluff BTL7-V50T, profile",
        {
            "non-linearity": "±0.03 mm",
            "hysteresis": "±0.01 mm",
            "non-repeatability": "±0.005 mm",
            "temperature drift": "0.009 mm/K (18 ppm/K)",
            "resolution": "0.001 mm",
            "update time": "1.4 ms (710 Hz)",
            "time to first position": "at once, absolute",
            "drift without reference": "none, absolute",
        },
        "Balluff, BTL7-V50T-M-P-C003, user's guide, 6.1 and 6.6",
    ),
)
"""Three sensors. Empty where a maker says nothing of a term."""
