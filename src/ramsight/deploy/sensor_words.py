"""What an exported sensor's outputs are, in words: of the C's header, its README and the FMU's description."""

from __future__ import annotations

from ramsight.sensor.checks.diagnosis import KINDS
from ramsight.sensor.kind import Kind
from ramsight.sensor.virtual_sensor import BOUND, HIGHEST, LOAD_AGE, LOWEST

_MEANING = {
    "position": "0 = retracted; NaN as long as it is unknown",
    "velocity": "positive extends",
    "load": "positive against lifting",
    LOAD_AGE: "since the torque showed the load last",
    "pressure_a": "chamber on the piston's side, absolute",
    "pressure_b": "chamber on the rod's side, absolute",
    "leak_factor": "leakage over the data sheet's",
    "leak_exponent": "by how much less than described the leakage grows with pressure, as an exponent",
    "displacement_factor": "displacement over the data sheet's",
    "compliance_factor": "compliance over the data sheet's",
    "mode": "what the piston is doing, a number of docs/explanation/contacts.md",
    LOWEST: "lower end of the 95 % band",
    HIGHEST: "upper end of the 95 % band",
    BOUND: "error that one sample in 100000 exceeds",
    "referenced_since_power_up": "whether a reference has come since the start, or since it was resumed",
    "torque_over_pressures": "reported torque less what the pressures ask for, lately",
    "speed_over_counter": "reported speed over the counter's, lately",
    "torque_missing": "torque by the drive's power less the reported one, lately",
    "sign_reversed": "evidence that the torque's sign is reversed, over that of an alarm",
}
_FAULTS = {
    "gain": "a gain", "offset": "an offset", "sign": "its sign", "stuck": "being stuck", "other": "something else",
}  # fmt: skip


def meaning(name: str) -> str:
    """What an output is, in words.

    Example:
        >>> meaning("low_probability")
        'probability that the retracted end is met elsewhere'
        >>> meaning("torque_offset_probability")
        'probability that what is wrong with the torque is an offset; 0 while nothing is'
        >>> meaning("leak_factor_std")
        'standard deviation of leak factor'
    """
    if name in _MEANING:
        return _MEANING[name]
    of, _, last = name.rpartition("_")
    if last == "std":
        return f"standard deviation of {of.replace('_', ' ')}"
    if last == "probability":
        for kind in Kind:
            if of == kind.text:
                return f"probability that {kind.words}"
        signal, _, fault = of.rpartition("_")
        if fault in KINDS:
            return f"probability that what is wrong with the {_report(signal)} is {_FAULTS[fault]}; 0 while nothing is"
    if last in _WRONG_BY:
        return _WRONG_BY[last].format(_report(of))
    return name.replace("_", " ")


def titled_meaning(name: str) -> str:
    """The same where an output's name does not stand beside it.

    Example:
        >>> titled_meaning("position"), titled_meaning("position_std")
        ('position: 0 = retracted; NaN as long as it is unknown', 'standard deviation of position')
    """
    words, said = name.replace("_", " "), meaning(name)
    return said if said == words or name.endswith(("_std", "_probability")) else f"{words}: {said}"


_WRONG_BY = {
    "gain": "by which the {} is multiplied, if that is its fault; 1 while nothing is wrong",
    "offset": "by which the {} is shifted, if that is its fault; 0 while nothing is wrong",
}


def _report(signal: str) -> str:
    return signal.replace("_", " ")
