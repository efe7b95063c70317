"""Where the piston of a hydraulic cylinder is, without a position sensor.

Everything that `dir(ramsight)` lists is imported when it is asked for first. Quantities are SI numbers, or text with a
unit: ``load="441 kN"``, ``start="120 mm"``.

Example:
    >>> import ramsight
    >>> boom = ramsight.build("mining-loader", unit="boom")
    >>> run = ramsight.simulate(boom, load="441 kN", oil_temperature="40 degC", start="120 mm")
    >>> track = ramsight.track(boom, ramsight.drive_report(run), start="120 mm", truth=run)
    >>> bool(track.attrs["error_largest"] < 1e-3)  # m
    True
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ramsight._version import __version__
from ramsight.circuit_picture import draw_circuits_by
from ramsight.late import late

if TYPE_CHECKING:
    from ramsight.api.calibrating import identify, identify_values, leak_test
    from ramsight.api.commissioning import commission
    from ramsight.api.duties import duty_for, lift_lower
    from ramsight.api.exporting import (
        diagnostic_coverage,
        export_c,
        export_fmeda,
        export_fmu,
        export_page,
        export_parameters,
        export_ssp,
        export_wasm,
    )
    from ramsight.api.histories import history, history_add, history_event, history_report
    from ramsight.api.live_plant import LivePlant
    from ramsight.api.live_weighing import LiveWeighing
    from ramsight.api.machines import catalogue
    from ramsight.api.plotting import draw, plot
    from ramsight.api.second_channel import compare, overlay
    from ramsight.api.shared_reports import check_shared
    from ramsight.api.simulating import drive_report, simulate
    from ramsight.api.simulating_many import simulate_many
    from ramsight.api.studying import Study
    from ramsight.api.tolerance_deriving import derive_tolerance
    from ramsight.api.tool_places import tool_place
    from ramsight.api.tracking import sensor_for, track
    from ramsight.api.weighing import weigh
    from ramsight.calibration.identify_record import IdentifyError
    from ramsight.calibration.leakage import LeakTestError
    from ramsight.duty.drive_response import DriveResponse
    from ramsight.duty.profile import Duty, Profile
    from ramsight.errors import (
        DescriptionError,
        LogError,
        LogWarning,
        MissingColumnError,
        MissingPackageError,
        OutputError,
        RamsightError,
        SimulationError,
        UnknownNameError,
    )
    from ramsight.histories.history_store import HistoryError
    from ramsight.logs import open_log, read_log
    from ramsight.machine import load_machine
    from ramsight.plant.as_built import AsBuilt
    from ramsight.plant.build import build
    from ramsight.plant.model import casadi_model
    from ramsight.sensor.contacts.mode import Mode
    from ramsight.sensor.status import Status
    from ramsight.sensor.virtual_sensor import Estimate, StartError
    from ramsight.tracking.named_faults import NamedFault, named_faults
    from ramsight.tracking.track_errors import ComparisonError

__all__ = [
    "AsBuilt", "ComparisonError", "DescriptionError", "DriveResponse", "Duty", "Estimate", "HistoryError",
    "IdentifyError", "LeakTestError", "LivePlant", "LiveWeighing", "LogError", "LogWarning", "MissingColumnError",
    "MissingPackageError", "Mode", "NamedFault", "OutputError", "Profile", "RamsightError", "SimulationError",
    "StartError", "Status", "Study", "UnknownNameError", "__version__", "build", "casadi_model", "catalogue",
    "check_shared", "commission", "compare", "derive_tolerance", "diagnostic_coverage", "draw", "drive_report",
    "duty_for", "export_c", "export_fmeda", "export_fmu", "export_page", "export_parameters", "export_ssp",
    "export_wasm", "history", "history_add", "history_event", "history_report", "identify", "identify_values",
    "leak_test", "lift_lower", "load_machine", "named_faults", "open_log", "overlay", "plot", "read_log",
    "sensor_for", "simulate", "simulate_many", "tool_place", "track", "weigh",
]  # fmt: skip

if not TYPE_CHECKING:  # so that a type checker sees the imports above, and knows every other name for a mistake
    __getattr__, __dir__ = late(__name__)  # most of it is heavy
    draw_circuits_by(lambda unit, name: __getattr__("draw")(unit, unit=name))
