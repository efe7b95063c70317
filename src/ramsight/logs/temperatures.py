"""Which channel is the oil's temperature, by names and units in the languages of those who make loggers."""

from __future__ import annotations

import re
import unicodedata

from ramsight.errors import DescriptionError
from ramsight.units import parse

_OIL = {
    "English": "oil|hyd|fluid",
    "German": "öl|oel",
    "French": "huile",
    "Spanish and Italian": "aceite|olio",
    "Dutch and Swedish": "olie|olja",
}
_TEMPERATURE = {
    "English, German, French, Italian": "temp",
    "symbols": r"[^a-zäöü]t$|(^|[^a-zäöü])t[^a-zäöü]|theta|ϑ",
}
_TANK = "tank|reservoir|réservoir|serbatoio|depósito|behälter|behaelter|sump|ölsumpf"
_OTHERS = (
    "motor|engine|moteur|wicklung|winding|stator|cool|kühl|kuehl|wasser|water|ambient|umgebung|aussen|außen|luft|air"
    "|gear|getriebe|inverter|umrichter|drive|antrieb|board|cpu|batt|akku|igbt|control|regler|heatsink|kühlkörper"
)
_UNITS = {
    "c", "degc", "deg c", "deg. c", "degreec", "degree c", "degrees c", "gradc", "grad c", "grad", "celsius",
    "°celsius", "grad celsius", "deg celsius", "degrees celsius", "ºc", "℃", "° c",
}  # fmt: skip

_OIL_NAME = re.compile("|".join(_OIL.values()))
_OIL_TEMPERATURE = re.compile(
    rf"({'|'.join(_OIL.values())}|{_TANK}).*({'|'.join(_TEMPERATURE.values())})"
    rf"|(temp|(^|[^a-zäöü])t[^a-zäöü]).*({'|'.join(_OIL.values())}|{_TANK})"
)
_ANY_TEMPERATURE = re.compile(r"temp")
_OTHER_NAME = re.compile(_OTHERS)


def temperature_score(name: str) -> int:
    """How well a name fits the oil's temperature: 4 for one that says oil or tank, 2 for any temperature, 0 for none.

    Example:
        >>> [temperature_score(name) for name in ("Hyd.T_oil", "Öltemp", "Temp", "Motor temperature", "Torque")]
        [4, 4, 2, 0, 0]
    """
    small = re.sub(r"\s*[\[(].*", "", unicodedata.normalize("NFC", name).lower())
    if _OIL_TEMPERATURE.search(small):
        return 4
    own = re.split(r"[./]", small)[-1] or small
    return 2 if _ANY_TEMPERATURE.search(own) and not _OTHER_NAME.search(own) else 0


def celsius(unit: str) -> str:
    """A unit, as ``degC`` where it is a spelling of that which is no unit elsewhere.

    Example:
        >>> celsius("C"), celsius("Grad C"), celsius("K")
        ('degC', 'degC', 'K')
    """
    try:
        parse(f"1 {unit}", "K")
    except DescriptionError:
        return "degC" if unit.strip().lower() in _UNITS else unit
    return unit
