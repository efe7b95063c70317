"""A position control's step as C, beside the sensor whose estimate it goes by."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.control.activity import ACTIVITIES
from ramsight.control.block import Block
from ramsight.control.orders import INPUTS, OUTPUTS, Reason
from ramsight.control.thresholds import STOPPING_TIME
from ramsight.deploy.c_function import PLAIN, array_function, golden_table, headings, indented, literal, template
from ramsight.deploy.c_sensor import SensorSource
from ramsight.deploy.c_step import field_of
from ramsight.duty.drive_response import DriveResponse
from ramsight.engine.typed_state import initial_values
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kind import Kind, state_of
from ramsight.sensor.quantity import Quantity


def control_source(block: Block, unit: HydraulicUnit, prefix: str, machine: str) -> SensorSource:
    """Header and body of a control."""
    macro = prefix.upper()
    common = headings(prefix, machine, f"Position control of the {unit.name}") | {"states": len(block.recursion.state)}
    header = template(
        "control.h",
        ms=f"{1e3 * block.by.period:g}",
        period=repr(block.by.period),
        stopping=f"{STOPPING_TIME:g}",
        speed=f"{block.by.limits.speed:.6g}",
        drive=declared(block.response),
        activities=indented(f"{macro}_{a.name} = {k}," for k, a in enumerate(ACTIVITIES)),
        reasons=indented(f"{macro}_REASON_{r.name} = {int(r)}, /* {r.text or 'none'} */" for r in Reason),
        **common,
    )
    body = template(
        "control.c",
        real=template("real.h"),
        advance=array_function("advance", _step(block), PLAIN),
        initial=", ".join(map(literal, initial_values(block.initial).tolist())),
        inputs=", ".join(f"order->{name}" for name in INPUTS),
        **_learned_names(),
        texts=indented((f'case {macro}_REASON_{r.name}: return "{r.text}";' for r in Reason), 4),
        **common,
    )
    return SensorSource(prefix, {f"{prefix}_control.h": header, f"{prefix}_control.c": body})


def _learned_names() -> dict[str, str]:
    """Members of the sensor's struct with the factors that it has learned of leakage and displacement."""
    of = {"leak": Quantity.LEAKAGE, "displacement": Quantity.DISPLACEMENT}
    return {name: field_of(state_of(Kind.DESCRIBED, one)) for name, one in of.items()}


def declared(drive: DriveResponse) -> str:
    """How a drive is declared, in words.

    Example:
        >>> declared(DriveResponse(command_delay=0.04, report_delay=0.04, lost=0.02))
        'commands 40 ms late, reports 40 ms late, 2 % lost, at once otherwise, give or take 5 rad/s'
    """
    late = {"commands": drive.command_delay, "reports": drive.report_delay}
    said = [f"{what} {1e3 * by:g} ms late" for what, by in late.items()]
    said += [f"{100.0 * drive.lost:g} % lost"] if drive.lost > 0.0 else []
    follows = [f"{drive.bandwidth:g} Hz of order {drive.order}"] if math.isfinite(drive.bandwidth) else []
    follows += [f"at most {drive.acceleration:g} rad/s2"] if math.isfinite(drive.acceleration) else []
    return ", ".join([*said, *(follows or ["at once otherwise"]), f"give or take {drive.deviation:g} rad/s"])


def _step(block: Block) -> ca.Function:
    """The step of a control whose moves have the acceleration of its limits, without the live control's outputs."""
    of, names = block.recursion.graph, block.recursion.state
    after = ca.vertcat(of.next_state, of.output[: len(OUTPUTS)])
    after = ca.densify(ca.substitute(after, of.p, block.by.limits.acceleration))
    new, out = ca.vertsplit(after, [0, len(names), after.numel()])
    return ca.Function("advance", [of.x, of.u], [new, out], ["x", "u"], ["x_new", "out"], {"cse": True})


def golden_control(source: SensorSource, rows: Any, said: NDArray[np.float64], fastest: float) -> SensorSource:
    """The same with a recorded run and the program that compares.

    Args:
        rows: inputs, shape (samples, inputs).
        said: motor speed [rad/s], activity and stop that was pressed [m], shape (samples, 3).
        fastest: largest motor speed [rad/s].
    """
    p = source.prefix
    text = (
        f"/* A simulated run, and what the control of ramsight {__version__} asked for in it. */\n#include <math.h>\n"
        f"#define GOLDEN {len(rows)}\n#define FASTEST {literal(fastest)} /* rad/s */\n"
        f"/* {', '.join(INPUTS)} */\n{golden_table('golden_in', np.asarray(rows))}"
        f"/* motor speed [rad/s], activity, end stop that was pressed [m] */\n{golden_table('golden_out', said)}"
    )
    program = template("control_test.c", p=p, row=", ".join(f"row[{k}]" for k in range(len(INPUTS))))
    return SensorSource(p, {**source.files, f"{p}_control_golden.h": text, f"{p}_control_test.c": program})
