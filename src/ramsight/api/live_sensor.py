"""A sensor as Python holds it: quantities as SI numbers, or as text with a unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

from ramsight.api.arguments import checked
from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.sensor.thresholds import START_STD
from ramsight.sensor.virtual_sensor import Estimate, VirtualSensor
from ramsight.signals import Dataset
from ramsight.units import as_float, is_real, name_of, parse

Quantity = float | str
_INPUTS = (("time", "s"), ("motor_speed", "rad/s"), ("motor_torque", "N m"), ("oil_temperature", "K"))


class Sensor(VirtualSensor):
    """A `VirtualSensor` whose `start` and `step` take text with a unit, too, and say in one line what cannot be.

    Example:
        >>> import ramsight
        >>> sensor = ramsight.sensor_for("mining-loader", unit="boom")
        >>> sensor.start("100 mm", std="1 mm")
        >>> now = sensor.step("0 s", motor_speed="0 rpm", motor_torque="0 N m", oil_temperature="40 degC")
        >>> now.position
        0.1
    """

    @classmethod
    def of(cls, sensor: VirtualSensor) -> Sensor:
        """The same sensor, with text read."""
        return cls(**{one.name: getattr(sensor, one.name) for one in fields(sensor) if one.init})

    def start(self, position: Quantity | None, std: Quantity = START_STD) -> None:
        """Forget everything and begin again.

        Args:
            position: where the piston is, 0 to the stroke [m], or ``"120 mm"``; None if unknown, which only `kalman`
                can work with.
            std: standard deviation of that, 0 to the stroke [m].

        Raises:
            StartError: the position is not known, and this sensor cannot find it by itself; or position or standard
                deviation cannot be. The sensor is then as it was.
            DescriptionError: one of them is no length.
        """
        known = None if position is None else read_input(position, "m", "position")
        super().start(known, read_input(std, "m", "std"))

    def step(
        self,
        time: Quantity,
        motor_speed: Quantity,
        motor_torque: Quantity,
        oil_temperature: Quantity,
        reference: Quantity | None = None,
        **others: float,
    ) -> Estimate:
        """Take one sample.

        Args:
            time: [s], increasing from sample to sample.
            motor_speed: [rad/s], or ``"1500 rpm"``.
            motor_torque: [N m].
            oil_temperature: [K], or ``"40 degC"``.
            reference: position known at this sample [m], from a switch or a stop; None or no finite number if none is.
            others: commands to the circuit's commanded parts, -1 to 1, by their names in `commands`; one that is left
                out, or NaN, is as before. And what is `optional`, in SI.

        Raises:
            DescriptionError: an input is no such quantity.
            UnknownNameError: the sensor takes no such input.
        """
        for name in others:
            if name not in self.further:
                raise UnknownNameError("input", name, self.further)
        at, speed, torque, oil = (
            read_input(value, unit, name)
            for value, (name, unit) in zip((time, motor_speed, motor_torque, oil_temperature), _INPUTS, strict=True)
        )
        known = None if reference is None else read_input(reference, "m", "reference")
        return super().step(at, speed, torque, oil, known, **others)

    @by_kind
    def says(self, output: str) -> float:
        """An output after the last `step`, by its name [SI]; NaN before the first one, and of one that it has not.

        Raises:
            DescriptionError: it is no text.
        """
        return super().says(output)

    @by_kind
    def track(self, log: Dataset, *, advance: Callable[[int], object] | None = None) -> Dataset:
        """Go through a drive log, from the position passed to `start`.

        Args:
            log: Dataset over `time` with motor_speed, motor_torque and oil_temperature, with the commands that the
                circuit takes, and perhaps reference, NaN where no position is known; in SI, or in what the ``units`` of
                a variable say.

        Returns:
            A Dataset over the same `time` with position, position_std, velocity, load, status, and whatever else
            this sensor knows, each with `units`.

        Raises:
            DescriptionError: it is no Dataset, or a variable has a unit of something else.
            LogError: a variable is absent, or holds what is no number.
        """
        return super().track(checked(log, "log"), advance=advance)


def read_input(value: Quantity, unit: str, name: str) -> float:
    """An input in SI; what a drive reports may be no finite number, which the sensor judges."""
    if isinstance(value, str):
        try:
            return parse(value, unit)
        except DescriptionError as error:
            raise DescriptionError(error.message, key=name, value=value) from None
    if not is_real(value):
        raise DescriptionError(f"expected {name_of(unit)}, or a number in {unit}", key=name, value=value)
    return as_float(value)
