"""Draw a machine's mechanism: `python -m ramsight.study.loader MACHINE FILE`."""

import sys
from pathlib import Path

from ramsight import machine
from ramsight.plant.linked import build_linked
from ramsight.study.loader.drawing import mechanism_figure

name, file = sys.argv[1:]
mechanism_figure(build_linked(machine.load(name)), Path(file))
