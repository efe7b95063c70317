"""A unit's circuit as a drawing with the symbols of ISO 1219-1, laid out from its parts and nodes.

`drawn` gives a sheet: symbols, lines and words at their places. `svg.text` and `svg.save` write it down. Lengths are
those of the drawing: 10 of its units are one module M of ISO 1219-1, 2.5 mm on paper, y is down.
"""

from ramsight.drawing.circuit_drawing import Sheet
from ramsight.drawing.layout import drawn

__all__ = ["Sheet", "drawn"]
