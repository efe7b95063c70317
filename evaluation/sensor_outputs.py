"""Writes the table of outputs from a sensor that has every output: python evaluation/sensor_outputs.py."""

from __future__ import annotations

import pages

from ramsight.deploy.sensor_words import meaning
from ramsight.machine import load_machine
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.virtual_sensor import VirtualSensor

MARK = "sensor_outputs"
DECLARED = {
    "assumptions.shaft.std": "0.05 deg",
    "assumptions.power.std": "0.5 %",
    "assumptions.inertia.std": "30 %",
    "assumptions.pressure.std": "1 bar",
    "assumptions.motor_temperature.std": "1 %",
}
"""What a machine declares whose sensor has every output."""


def sensors() -> tuple[VirtualSensor, VirtualSensor]:
    """The sensor of a machine that declares nothing, and of one that declares everything."""
    machine = load_machine("mining-loader")
    boom = machine.unit("boom")
    plain, full = boom, boom.replace(DECLARED)
    return kalman(build(plain, "boom")), kalman(build(full, "boom"))


def rows() -> list[str]:
    """An output a row; those of declared signals say which."""
    plain, full = sensors()
    lines = ["| output | unit | meaning | there |", "|---|---|---|---|"]
    for name in full.recursion.outputs:
        words = "number of the [status](status.md)" if name == "status" else meaning(name)
        words = words.replace("a number of docs/explanation/contacts.md", "a [mode](../explanation/contacts.md#modes)")
        always = "always" if name in plain.recursion.outputs else "with further signals"
        unit = full.units.get(name, "")
        lines.append(f"| `{name}` | {'' if unit == '1' else unit} | {words} | {always} |")
    return lines


def main() -> None:
    """Renew the table."""
    pages.put(pages.page_of(MARK), {MARK: rows()})


if __name__ == "__main__":
    main()
