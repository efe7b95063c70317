"""What an export says of itself: the description that it was made of, version, command, digests, and a card."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

from ramsight._version import __version__
from ramsight.deploy.fmeda import fmeda_table
from ramsight.deploy.profiles import Profile
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import RPM

DESCRIPTION = "description.toml"
"""The machine; what `command` exports once more."""
CARD = "card.srmd"
"""What a machine reads of the export: attributes of MIC Core."""
FMEDA = "fmeda.csv"
"""Faults of a sensor and what detects them, `ramsight.deploy.fmeda`."""
_TRACE = "http://ssp-standard.org/SSPTraceability1"
_UNCHECKED = "none: no commissioning and no data sheet of this machine is attached"
_CRITERIA = "as in Python: positions of a sensor within 1e-9 m and the same statuses, a plant's within 1e-6 m"
_SENSOR = "Position of a hydraulic cylinder from the speed and torque of its pumps' motor; no safety function"
_PURPOSE = {
    "sensor": _SENSOR,
    "control": f"{_SENSOR}; and a position control with it as the only feedback",
    "compare": f"{_SENSOR}; held against a real sensor",
    "weighing": f"{_SENSOR}; and a weighing of what it lifts, which is no scale for trade",
    "plant": "Simulation of a hydraulic unit with its cylinder",
}


@dataclass(frozen=True)
class Export:
    """What was exported."""

    machine: Machine
    unit: HydraulicUnit  # its unit
    what: str  # `sensor`, `control`, `compare`, `weighing` or `plant`
    command: Sequence[str]  # arguments of `ramsight export` behind the machine's file, for example `fmu --fmi 3`
    verified: str = ""  # what was run to verify it, and how it went; empty if nothing was
    # of its sensor. The study of faults measured `KALMAN`; only that has an FMEDA table.
    profile: Profile = Profile.KALMAN


def credentials(export: Export, content: Mapping[str, bytes]) -> dict[str, str]:
    """Description, record and card, and a sensor's FMEDA table: text by file name, the same for the same export.

    Args:
        content: its files by name; the record has the SHA-256 of each, and of the description.
    """
    described = "\n".join(as_toml(export.machine, export.machine.sources)) + "\n"
    kind, *options = export.command
    table = {} if export.what == "plant" or export.profile is not Profile.KALMAN else {FMEDA: fmeda_table(export.unit)}
    every = {**content, DESCRIPTION: described.encode(), **{name: text.encode() for name, text in table.items()}}
    record = {
        "ramsight": __version__,
        "machine": export.machine.name,
        "unit": export.unit.name,
        "what": export.what,
        "command": " ".join(["ramsight export", kind, DESCRIPTION, "--unit", export.unit.name, *options]),
        "sha256": {name: hashlib.sha256(every[name]).hexdigest() for name in sorted(every)},
    }
    return {
        DESCRIPTION: described,
        **table,
        "ramsight.json": json.dumps(record, indent=2) + "\n",
        CARD: card(export, record["command"]),
    }


def card(export: Export, command: object) -> str:
    """The attributes of MIC Core as Simulation Resource Meta Data 1.0; what ramsight does not know it says so."""
    unit, limits, name = export.unit, limits_of(export.unit), f"{export.machine.name} {export.unit.name} {export.what}"
    limitations = (
        f"stroke {1e3 * unit.cylinder.stroke:.6g} mm; pressure up to {1e-5 * limits.pressure:.4g} bar; load up to "
        f"{1e-3 * limits.load:.4g} kN; motor speed up to {limits.max_speed / RPM:.5g} rpm; "
        "samples 1 to 100 ms apart"
    )
    entries = {
        "administrative-data.model.name": name,
        "administrative-data.model.identifier": name.replace(" ", "."),
        "administrative-data.model.description": f"{_PURPOSE[export.what]}: {export.machine.title or name}",
        "administrative-data.model.supplier": "not stated: whoever passes this file on",
        "administrative-data.model.confidentiality-level": "1: internal",
        "administrative-data.legal-restriction": "not stated",
        "administrative-data.release": f"ramsight {__version__}",
        "administrative-data.release.type": "export by command",
        "purpose-objectives.model": _PURPOSE[export.what],
        "subject-information.modelled-entity": f"unit {unit.name} of {export.machine.title or export.machine.name}",
        "implementation.model.classification": "physical, lumped parameters, C99 source code",
        "implementation.modeling-choice": f"{DESCRIPTION} has every value and, where stated, its source; {command}",
        "implementation.model.limitations": limitations,
        "implementation.software-hardware-environment-requirements": "a C99 or C++11 compiler with IEEE 754 and libm",
        "verification-validation.verification-status": export.verified or "not run where it was exported",
        "verification-validation.validation-status": _UNCHECKED,
        "verification-validation.procedure-criteria": _CRITERIA,
        "verification-validation.report": "ramsight.json has the digests of the files",
    }
    own = {} if export.what == "plant" else {"profile": export.profile.words}
    spaces = f'xmlns:srmd="{_TRACE}/SimulationResourceMetaData" xmlns:stc="{_TRACE}/SSPTraceabilityCommon"'
    head = f'<srmd:SimulationResourceMetaData version="1.0" name={quoteattr(name)} {spaces}>'
    body = _classified("org.mic-core.mic-core", entries) + _classified("org.ramsight.export", own)
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', head, *body, "</srmd:SimulationResourceMetaData>", ""])


def _classified(kind: str, entries: Mapping[str, str]) -> list[str]:
    """Lines of entries of one kind; none if there are none."""
    lines = [
        f"    <stc:ClassificationEntry keyword={quoteattr(key)}>{escape(text)}</stc:ClassificationEntry>"
        for key, text in entries.items()
    ]
    return [f'  <stc:Classification type="{kind}">', *lines, "  </stc:Classification>"] if lines else []
