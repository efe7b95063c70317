"""An encoder made ready to go on a bus: sensor compiled, state resumed, parameters found."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from ramsight.deploy.encoder.beside import ALERT, TOLERANCE
from ramsight.deploy.encoder.encoder import Encoder, Settings
from ramsight.deploy.encoder.listening import Listener, Sample
from ramsight.deploy.encoder.parameters import SUFFIX, ParameterFile
from ramsight.deploy.encoder.saving import Persistence
from ramsight.deploy.encoder.second_node import PERIOD
from ramsight.errors import DescriptionError
from ramsight.logs.mapped import ChannelMap
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.tool.weigher import Weigher
from ramsight.tracking.comparing import Comparison

_OWN = (0x180, 0x280)  # of its process data, plus the node-ID
HOLD, TIMEOUT = (0x2000, 0), (0x2002, 0)


def encoder_for(
    unit: HydraulicUnit,
    channel_map: ChannelMap,
    settings: Settings,
    state: Path | None = None,
    *,
    aside: bool = False,
    record: Callable[[Sample], object] = lambda sample: None,
    weigher: Weigher | None = None,
) -> Encoder:
    """An encoder with a `kalman` sensor, ready to be started.

    Args:
        unit: the unit it watches.
        channel_map: what the drive's frames mean.
        settings: who it is on the bus.
        state: where sensor and parameters are kept over a power loss (the latter with ``.parameters`` after the name);
            this encoder's alone, as long as it runs.
        aside: whether the state is saved by a thread of its own.
        record: is passed each sample that the sensor takes.
        weigher: of the machine, if the unit lifts what it weighs.

    Raises:
        DescriptionError: the map cannot be used.
        UnknownNameError: the map names a channel that is in no frame.
        HeldError: another program has the file of the state.
    """
    sensor, listener = kalman(unit), Listener(channel_map)
    own = {base + settings.node_id for base in _OWN}
    if listener.identifiers & own:
        raise DescriptionError(
            f"is what the encoder, node {settings.node_id}, sends itself",
            file=channel_map.file,
            key="can.pdo.cob_id" if channel_map.file else "--drive-node",
            value=f"{min(listener.identifiers & own):X}h",
            allowed="frames of the drive, or another --node-id",
        )
    # The first steps compile, which takes longer than any cycle.
    compiled = replace(sensor)
    compiled.start(None)
    compiled.step(0.0, 0.0, 0.0, math.nan)
    if listener.has_other:
        Comparison(1.0, 1.0, 1.0).step(0.0, 0.0, 0.0, 0, 0.0)
    instance = f"{unit.name}, node {settings.node_id}, serial number {settings.serial}"
    persistence = None if state is None else Persistence(state, sensor, aside=aside, instance=instance)
    parameters = None if state is None else ParameterFile(state.with_name(state.name + SUFFIX))
    return Encoder(
        sensor, unit, listener, settings, persistence=persistence, parameters=parameters, record=record, weigher=weigher
    )


def overrides(
    hold: bool,
    timeout: float | None,
    tolerance: float | None = None,
    alert: float | None = None,
    period: float | None = None,
) -> Mapping[tuple[int, int], int]:
    """What options set in the dictionary; None leaves it.

    Args:
        timeout: of the drive [s].
        tolerance: of a real sensor [m].
        alert: for which it has to be apart from the virtual one [s].
        period: between two frames of the drive [s].
    """
    options = ((TIMEOUT, timeout, 1e3), (TOLERANCE, tolerance, 1e6), (ALERT, alert, 1e3), (PERIOD, period, 1e4))
    chosen = {key: round(scale * value) for key, value, scale in options if value is not None}
    return {**chosen, HOLD: 0} if hold else chosen
