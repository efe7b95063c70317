"""Where the piston of a hydraulic cylinder is, without a position sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ramsight.plant.model import casadi_model as casadi_model

__version__ = "0.1.0.dev0"


def __getattr__(name: str) -> Any:
    """Load what is heavy only when it is asked for."""
    if name == "casadi_model":
        from ramsight.plant.model import casadi_model

        return casadi_model
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
