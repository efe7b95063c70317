"""One declaration per parameter: unit, range and meaning; checks, schema, template and tables follow."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, get_args

from pydantic import BaseModel, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError, core_schema

from ramsight import units
from ramsight.errors import DescriptionError

#: validation context of values that come from a file, where a number without a unit is rejected
FROM_FILE: Mapping[str, bool] = {"from_file": True}


_SMALLEST = 1e-15
"""Of the largest value allowed: less than the digits that a double has."""


@dataclass(frozen=True)
class Quantity:
    """The declaration of a physical parameter; stands in `Annotated[float, quantity(...)]`."""

    unit: str
    text: str
    above: str | None = None
    least: str | None = None
    below: str | None = None
    most: str | None = None
    whole: bool = False
    teeth: bool = False

    @property
    def range(self) -> str:
        """The allowed range in the units it was declared in, for example ``at least 1 mm, at most 1 m``."""
        words = (("above", self.above), ("at least", self.least), ("below", self.below), ("at most", self.most))
        return ", ".join(f"{word} {bound}" for word, bound in words if bound is not None)

    def read(self, value: Any, *, from_file: bool = False) -> float | int:
        """Turn a value into SI and check its range.

        Args:
            value: text with a unit, or an SI number (from a file only where no unit is needed).
            from_file: whether the value stands in a file.

        Raises:
            DescriptionError: the value cannot be used.
        """
        plain = not from_file and isinstance(value, int | float) and not isinstance(value, bool)
        number = units.parse(value, "1" if plain else self.unit)
        checks: tuple[tuple[str | None, Callable[[float, float], bool]], ...] = (
            (self.above, operator.gt),
            (self.least, operator.ge),
            (self.below, operator.lt),
            (self.most, operator.le),
        )
        for bound, holds in checks:
            if bound is not None and not holds(number, units.parse(bound, self.unit)):
                shown = units.format_si(number, self.unit, 6) if plain else value
                raise DescriptionError("out of range", value=shown, allowed=self.range)
        if 0.0 < abs(number) < self._smallest:
            shown = units.format_si(number, self.unit, 6) if plain else value
            raise DescriptionError("too small to be anything but 0", value=shown, allowed=self.range)
        if not self.whole:
            return number
        if number != round(number):
            raise DescriptionError("expected a whole number", value=value, allowed=self.range)
        return round(number)

    @property
    def _smallest(self) -> float:
        """What a value other than 0 is at least [SI]; smaller ones lose all digits where they are added to others."""
        ends = [units.parse(bound, self.unit) for bound in (self.above, self.least, self.below, self.most) if bound]
        return _SMALLEST * max(map(abs, ends), default=0.0)

    def show(self, value: float, digits: int | None = None) -> str:
        """Write an SI value in the declared unit; teeth as ``28/41``, so that they come back exactly."""
        if self.teeth and digits is None:
            ratio = Fraction(value).limit_denominator(1000)
            if float(ratio) == value and ratio.denominator > 1:
                return f"{ratio.numerator}/{ratio.denominator}"
        return units.format_si(value, self.unit, digits)

    def _validate(self, value: Any, info: ValidationInfo) -> float | int:
        try:
            return self.read(value, from_file=bool(info.context and info.context.get("from_file")))
        except DescriptionError as error:
            context = {"text": error.message, "value": error.value, "allowed": error.allowed}
            raise PydanticCustomError("quantity", "{text}", context) from None

    def __get_pydantic_core_schema__(self, _source: Any, _handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(
        self, _schema: core_schema.CoreSchema, _handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        dimensionless = self.unit in ("1", "%")
        plain: dict[str, Any] = {"type": ["string", "number"] if dimensionless else "string"}
        sourced = {
            "type": "object",
            "properties": {"value": plain, "source": {"type": "string"}},
            "required": ["value"],
            "additionalProperties": False,
        }
        words = f"{self.text} [{self.unit}]" if not dimensionless else self.text
        words += f"; {self.range}" if self.range else ""
        return {"anyOf": [plain, sourced], "description": words, "x-unit": self.unit, "x-range": self.range}


def quantity(
    unit: str,
    text: str,
    *,
    above: str | float | None = None,
    least: str | float | None = None,
    below: str | float | None = None,
    most: str | float | None = None,
) -> Quantity:
    """Declare a physical parameter.

    Each has a least and a greatest value that physics gives: beyond them no such machine is, and a slip of a unit or a
    hostile file would make laws divide by next to nothing.

    Args:
        unit: the unit it is shown in; any unit of the same dimension may be written.
        text: what it is, for people.
        above: lower bound that is not itself allowed: a number in that unit, or with a unit of its own.
        least: lower bound that is allowed, as `above`.
        below: upper bound that is not itself allowed, as `above`.
        most: upper bound that is allowed, as `above`.
    """

    def said(bound: str | float | None) -> str | None:
        return bound if bound is None or isinstance(bound, str) else f"{bound} {unit}".removesuffix(" 1")

    return Quantity(unit, text, said(above), said(least), said(below), said(most))


def count(text: str, *, least: int, most: int) -> Quantity:
    """Declare a whole number."""
    return Quantity("1", text, least=str(least), most=str(most), whole=True)


def gearing(text: str, *, above: str, most: str) -> Quantity:
    """Declare a gear or belt ratio, which may be written as teeth over teeth."""
    return Quantity("1", text, above=above, most=most, teeth=True)


def refuse(key: str, value: object, message: str, allowed: str | None = None) -> PydanticCustomError:
    """Make the error of a check that looks at several keys at once, to be raised by a model validator.

    Args:
        key: the key to blame, relative to the model.
    """
    return PydanticCustomError("cross", "{text}", {"text": message, "key": key, "value": value, "allowed": allowed})


#: the field by which a part names a catalogue entry
Model = Annotated[str | None, Field(description="name of a catalogue entry that has the values left out here")]


def declaration(field: FieldInfo) -> Quantity | None:
    """Return the declaration of a field, or `None` if it holds words or a table."""
    return next((item for item in field.metadata if isinstance(item, Quantity)), None)


def model_class(annotation: Any) -> type[BaseModel] | None:
    """The class of parts that a field holds, be the part optional or not; `None` if it holds something else."""
    for kind in (annotation, *get_args(annotation)):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return kind
    return None


def explain(field: FieldInfo) -> str:
    """Return what a field means, in words."""
    declared = declaration(field)
    if declared is not None:
        return declared.text
    return field.description or next((one.text for one in field.metadata if hasattr(one, "text")), "")
