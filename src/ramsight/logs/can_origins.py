"""Where CAN frames came from: two drives of one kind that send the same are not one channel."""

from __future__ import annotations

from ramsight.errors import LogError
from ramsight.logs.frames import EXTENDED


class Origins:
    """Counts the buses and J1939 addresses from which the frames of each identifier or group came.

    Attributes:
        is_mixture_refused: whether a second origin of the same frames is an error, as where they are to be one channel.
    """

    def __init__(self, file: str) -> None:
        self._file = file
        self._known: dict[int, dict[tuple[int, int | None, int | None], int]] = {}
        self._passed: dict[int, set[int]] = {}
        self.is_mixture_refused = True

    def take(self, key: int, bus: int, source: int | None, to: int | None = None) -> None:
        """Take a frame.

        Args:
            key: its identifier, or its J1939 group.
            source: its J1939 address, None of other frames.
            to: the J1939 address that it goes to, None of others.

        Raises:
            LogError: frames of this key came from elsewhere before.
        """
        known = self._known.get(key)
        if known is None:
            known = self._known[key] = {}
        origin = (bus, source, to)
        known[origin] = known.get(origin, 0) + 1
        if len(known) > 1 and self.is_mixture_refused:
            raise LogError(self.mixed, file=self._file)

    @property
    def buses(self) -> list[int]:
        """The buses on which the same frames came, none if each came on one."""
        several = [{bus for bus, _, _ in known} for known in self._known.values()]
        return sorted(set().union(*(one for one in several if len(one) > 1)))

    @property
    def sources(self) -> list[int]:
        """The J1939 addresses from which the same groups came, none if each came from one."""
        several = [{source for _, source, _ in known if source is not None} for known in self._known.values()]
        return sorted(set().union(*(one for one in several if len(one) > 1)))

    @property
    def others(self) -> list[int]:
        """The J1939 addresses that send groups which come from nowhere else."""
        single = [{source for _, source, _ in known if source is not None} for known in self._known.values()]
        return sorted(set().union(*(one for one in single if len(one) == 1)) - set(self.sources))

    @property
    def destinations(self) -> list[int]:
        """The J1939 addresses to which the same groups go, none if each goes to one."""
        several = [{to for _, _, to in known if to is not None} for known in self._known.values()]
        return sorted(set().union(*(one for one in several if len(one) > 1)))

    def pass_over(self, key: int, source: int) -> None:
        """Take a frame of a group that the map wants from other addresses."""
        self._passed.setdefault(key, set()).add(source)

    @property
    def passed(self) -> str:
        """Which groups came from addresses that the map does not name alone; "" if none did."""
        found = {key: of for key, of in self._passed.items() if key not in self._known}
        if not found:
            return ""
        listed = [f"{key:X}h from {', '.join(f'{one:02X}h' for one in sorted(of))}" for key, of in found.items()]
        return f": [can] source is a list of addresses, and the log has group {', '.join(listed)}"

    @property
    def mixed(self) -> str:
        """What is mixed, and which key of a map chooses; "" if nothing is."""
        said = []
        for key, known in self._known.items():
            name = f"{key & ~EXTENDED:X}h"
            addresses = sorted({source for _, source, _ in known if source is not None})
            goals = sorted({to for _, _, to in known if to is not None})
            buses = sorted({bus for bus, _, _ in known})
            if len(addresses) > 1:
                listed = ", ".join(f"{one:02X}h" for one in addresses)
                said.append(
                    f"J1939 group {name} comes from the addresses {listed}: [can] source = 0x{addresses[0]:02X}"
                )
            elif len(goals) > 1:
                listed = ", ".join(f"{one:02X}h" for one in goals)
                said.append(f"J1939 group {name} goes to the addresses {listed}: [can] destination = 0x{goals[0]:02X}")
            elif len(buses) > 1:
                listed = ", ".join(map(str, buses))
                said.append(f"frame {name} comes on the buses {listed}: [can] bus = {buses[0]}")
        more = f" (and {len(said) - 1} more such)" if len(said) > 1 else ""
        return f"{said[0]} or another chooses one in the channel map{more}" if said else ""
