"""A position control behind the sensor of an FMU."""

from __future__ import annotations

from ramsight.control.block import Block
from ramsight.control.orders import Ask
from ramsight.deploy.c_control import control_source
from ramsight.deploy.fmu_behind import Behind
from ramsight.deploy.fmu_units import UNKNOWN, Variable
from ramsight.plant.unit import HydraulicUnit

_ASKED = "0: stop, 1: go to the target, 2: steer, 3: visit the end stop of lowering, 4: of lifting, 5: leak test"
_ORDERS = (
    Variable("ask", "real", "input", "", _ASKED, float(Ask.POSITION), None, 0.0, float(max(Ask))),
    Variable("target", "real", "input", "m", "where to; 1e10: nowhere", UNKNOWN),
    Variable("steering", "real", "input", "m/s", "velocity by hand, positive extends", 0.0),
    Variable("speed", "real", "input", "m/s", "largest velocity of a move or a visit", UNKNOWN),
)
_COMMANDED = (
    Variable("motor_speed_command", "real", "output", "rad/s", "motor speed at the next sample"),
    Variable("activity", "real", "output", "", "what the control is doing, a number of the header"),
    Variable("reason", "real", "output", "", "why it stops or has stopped; 0: it does not"),
)


def control_behind(block: Block, unit: HydraulicUnit, prefix: str, machine: str) -> Behind:
    """A position control."""
    of = f"{prefix}_control"
    orders = "".join(f"  order.{v.name} = m->real[{v.name.upper()}];\n" for v in _ORDERS)
    sensed = f"  {of}_inputs order;\n  {of}_sense(&order, &m->memory.sensor, &in, &out);\n{orders}"
    return Behind(
        control_source(block, unit, prefix, machine).files,
        f"{of}.h",
        f"{of} control;",
        _ORDERS,
        _COMMANDED,
        (),
        lambda place: f"  {of}_init(&m->memory.control);\n{_commanded('0.0', place)}",
        lambda place: sensed + _commanded(f"{of}_step(&m->memory.control, &order)", place),
        " and position control",
        block.by.period,
        f"  {of}_refer(&m->memory.control, &m->memory.sensor);\n",
    )


def _commanded(speed: str, place: int) -> str:
    said = (speed, "(double)m->memory.control.activity", "(double)m->memory.control.reason")
    return "".join(f"  m->real[{place + k}] = {text};\n" for k, text in enumerate(said))
