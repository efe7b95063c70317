"""Draw a machine's mechanism: `python -m ramsight.showcase.loader MACHINE FILE`."""

import sys
from pathlib import Path

from ramsight import machine
from ramsight.drawing.mechanism.side_view import mechanism_figure
from ramsight.plant.linked import build_linked

name, file = sys.argv[1:]
mechanism_figure(build_linked(machine.load_machine(name)), Path(file))
