"""What of a bus can tell an encoder that the drive's data are frozen, late or another's, by its channel map."""

from __future__ import annotations

from ramsight.control.repeats import repeats_in_a_row
from ramsight.deploy.encoder.listening import Listener
from ramsight.deploy.encoder.liveness import LATE, USUAL_PERIOD
from ramsight.logs.mapped import ChannelMap

Witness = tuple[str, bool, str]
"""What it is called, whether the bus has it, and what it tells or what is missing."""


def witnesses(channel_map: ChannelMap) -> list[Witness]:
    """What tells, and what the bus lacks.

    Raises:
        DescriptionError: the map is none of CAN frames.

    Example:
        >>> from ramsight.deploy.encoder.listening import drive_map
        >>> [(name, there) for name, there, _ in witnesses(drive_map(5, rated_torque=80.0))]
        [('sequence', False), ('noise', False), ('state', False), ('heartbeat', False)]
    """
    listener = Listener(channel_map)
    return [_sequence(listener), _noise(listener), _state(listener), _HEARTBEAT]


_LONGEST = 1.0  # s; what takes longer tells nothing in time
_HEARTBEAT = ("heartbeat", False, "no map states it: write the drive's node and its time into 1016h of the encoder")


def _sequence(listener: Listener) -> Witness:
    found = listener.sequence
    if found is None:
        return (
            "sequence",
            False,
            "[sequence] of the torque's frame, a counter, toggle bit or SYNC counter, tells late data",
        )
    tells = "frozen frames" if found.modulus <= 2.0 * LATE else f"frozen frames, and those {LATE:g} periods late"
    return "sequence", True, f"{found.channel} tells {tells}"


def _noise(listener: Listener) -> Witness:
    if not listener.noise:
        return "noise", False, 'noise = "0.5 N m" of [torque], if it has noise, tells frozen frames'
    enough = repeats_in_a_row(listener.noise, listener.torque_step or 1e-3 * listener.noise, USUAL_PERIOD)
    if enough * USUAL_PERIOD > _LONGEST:
        return (
            "noise",
            False,
            f"{listener.noise:g} N m is too little to be seen in steps of {listener.torque_step:g} N m",
        )
    return "noise", True, f"{enough:g} equal torques in a row are frozen"


def _state(listener: Listener) -> Witness:
    if not listener.has_state:
        return "state", False, '[state] channel = "6041h" tells a drive that is not enabled'
    return "state", True, "6041h tells a drive that is not enabled"
