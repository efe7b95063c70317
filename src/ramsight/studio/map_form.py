"""The channel map as a form: for each quantity the channel, its unit and its sign, beside the text that it becomes."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
from typing import Any

import tomlkit
from nicegui import ui
from tomlkit.exceptions import TOMLKitError

from ramsight.logs.channels import MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE, TIME
from ramsight.logs.guess import is_share

_SHARES = ("%", "‰")
ROLES = {
    "time": ("time", ("s", "ms", "us", "min")),
    "speed": ("motor speed", ("rpm", "1/min", "rad/s", *_SHARES)),
    "torque": ("motor torque", ("N m", *_SHARES)),
    "temperature": ("oil temperature", ("degC", "°C", "K")),
    "position": ("true position, where it was measured", ("mm", "m", "cm")),
}
"""What a log is asked for: its name, and usual units."""
_SIGNED = ("speed", "torque")
_STANDARD = {TIME, *(one.column for one in (MOTOR_SPEED, MOTOR_TORQUE, OIL_TEMPERATURE))}


@dataclass(frozen=True)
class Entry:
    """What a map says of one quantity; "" where it says nothing."""

    # channel, unit: as in the map
    channel: str = ""
    unit: str = ""
    rated: str = ""  # what 100 % is
    constant: str = ""  # a temperature that nobody measures
    is_reversed: bool = False  # whether its sign is negative


def is_standard(channels: set[str]) -> bool:
    """Whether a log has the usual columns, so that it needs no map."""
    return channels >= _STANDARD


def entry(text: str, role: str) -> Entry:
    r"""What a map says of a quantity of `ROLES`; nothing where the text is no TOML.

    Example:
        >>> entry('[torque]\nchannel = "M"\nunit = "%"\nsign = -1', "torque")
        Entry(channel='M', unit='%', rated='', constant='', is_reversed=True)
    """
    try:
        found: Any = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return Entry()
    for key in ("measured", "position") if role == "position" else (role,):
        found = found.get(key, {}) if isinstance(found, dict) else {}
    if not isinstance(found, dict):
        return Entry()
    said = {name: str(found.get(name, "")) for name in ("channel", "unit", "rated", "constant")}
    return Entry(**said, is_reversed=found.get("sign", 1) == -1)


def with_entry(text: str, role: str, said: Entry) -> str:
    r"""The map with another entry of a quantity; what else it says, and its comments, stay.

    Args:
        text: the map; it stays as it is where it is no TOML.
        said: the entry; without a channel and a constant temperature there is none.

    Example:
        >>> with_entry("# mine\n", "position", Entry("Weg", "mm")).splitlines()[-2:]
        ['[measured]', 'position = {channel = "Weg", unit = "mm"}']
    """
    try:
        map_ = tomlkit.parse(text)
    except TOMLKitError:
        return text
    if role == "position":
        if not isinstance(map_.get("measured", {}), MutableMapping):
            map_.pop("measured")
        measured: Any = map_.setdefault("measured", tomlkit.table())
        _place(measured, role, said, tomlkit.inline_table)
        if not measured:
            map_.pop("measured")
    else:
        _place(map_, role, said, tomlkit.inline_table if role == "time" else tomlkit.table)
    return tomlkit.dumps(map_)


def _place(within: Any, role: str, said: Entry, make: Callable[[], Any]) -> None:
    """Put an entry into a table of the map, or take it away."""
    if said.channel or said.constant:
        own = within.get(role)
        own = own if isinstance(own, MutableMapping) else make()
        _filled(own, role, said)
        within[role] = own
    else:
        within.pop(role, None)


def _filled(own: Any, role: str, said: Entry) -> None:
    """Put what an entry says into a table of the map; other keys of it stay."""
    wanted = {"channel": said.channel, "unit": said.unit if said.channel else "", "rated": said.rated}
    wanted["constant"] = "" if said.channel else said.constant
    for key, value in wanted.items():
        if value:
            own[key] = value
        else:
            own.pop(key, None)
    if role in _SIGNED and said.channel:
        own["sign"] = -1 if said.is_reversed else 1


class MapForm:
    """The form of a map.

    Args:
        text: gives the map's text as it is now; it may have been edited beside the form.
    """

    def __init__(self, text: Callable[[], str], changed: Callable[[str], object]) -> None:
        self._text, self._changed = text, changed
        self._place = ui.element("div").classes("map-form w-full").props("id=map-form")

    def show(self, channels: list[str]) -> None:
        """Lay the form out for the map and the channels that a log has."""
        self._place.clear()
        with self._place:
            for role, (name, units) in ROLES.items():
                self._row(role, name, units, channels)

    def _row(self, role: str, name: str, units: tuple[str, ...], channels: list[str]) -> None:
        said = entry(self._text(), role)
        with ui.row().classes("items-end gap-2 w-full"):
            options = {"": "none", **{one: one for one in channels}}
            if said.channel not in options:
                options[said.channel] = said.channel
            channel = ui.select(options, value=said.channel, label=name).classes("w-60")
            known = list(dict.fromkeys([*([said.unit] if said.unit else []), *units]))
            unit = ui.select(known, value=said.unit or units[0], label=f"unit of {name.partition(',')[0]}")
            unit.classes("w-28")
            rated = ui.input(f"100 % of the {name} is", value=said.rated).classes("w-48")
            constant = ui.input("or the same all the time", value=said.constant, placeholder="45 degC").classes("w-48")
            turned = ui.checkbox("reversed", value=said.is_reversed).props(f'aria-label="{name} is reversed"')
        signed = role in _SIGNED

        def fit() -> None:
            rated.set_visibility(signed and is_share(unit.value or ""))
            constant.set_visibility(role == "temperature" and not channel.value)
            turned.set_visibility(signed)

        def take() -> None:
            fit()
            now = Entry(
                channel.value or "", unit.value or "", (rated.value or "") if rated.visible else "",
                (constant.value or "") if role == "temperature" else "", bool(turned.value),
            )  # fmt: skip
            self._changed(with_entry(self._text(), role, now))

        fit()
        for one in (channel, unit, rated, constant, turned):
            one.on_value_change(take)
