"""How far a pump's described losses may be off: what leak test and identification allow for."""

from __future__ import annotations

import math

EFFICIENCY = 0.02 / math.sqrt(3.0)
"""Standard deviation of a described hydro-mechanical efficiency [1]: anywhere within +-0.02, as the catalogue says of
pumps whose curves were read."""
NO_LOAD_TORQUE = 0.25
"""Of a described no-load torque over it [1]; data sheets rarely give one, and oil and age change it. [G]"""
