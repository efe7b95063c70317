"""What an axis will achieve: the sensor's data sheet and error budget, from machines drawn from their tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ramsight.api.requirements import required_unit
from ramsight.argument_kinds import by_kind, whole_argument
from ramsight.calibration.sensors import check_kind_of_sensor
from ramsight.errors import DescriptionError
from ramsight.machine import AnyMachine, load_machine, only_unit
from ramsight.machine.requirement_description import DAY, Requirement
from ramsight.optional import check_extra
from ramsight.plant.build import build
from ramsight.progress import advancing
from ramsight.signals import Dataset
from ramsight.study.datasheet.budget import Budget, budget, check_base
from ramsight.study.datasheet.cluster import run
from ramsight.study.datasheet.sheet import Sheet, data_sheet
from ramsight.study.datasheet.sheet_requirement import SheetRequirement, held_against, mending, required
from ramsight.study.datasheet.studied_duties import Work
from ramsight.study.datasheet.study_plan import plan
from ramsight.units import argument

Quantity = float | str
_MOST = 10_000_000  # machines
_MOST_THREADS = 1024
_VISIT_EVERY = 45.0  # s, of a work day


def check_client(client: Any) -> None:
    """Refuse what is no client of a cluster.

    Args:
        client: as it was passed; None for none.

    Raises:
        DescriptionError: it is none.
    """
    if client is not None and not (hasattr(client, "nthreads") and hasattr(client, "submit")):
        raise DescriptionError("is no client", key="client", value=client, allowed="dask.distributed.Client")


class Study:
    """Machines that a data sheet and its tolerances allow, simulated and tracked.

    Args:
        machine: its description, name or file.
        duty: what each machine does: ``work-day``, ``loader-boom``, ``loader-bucket``, ``lift-lower``,
            ``commissioning``, or the file of a table.
        sensor: as `sensor_for`'s kind.
        unit: name of the unit; may be left out where there is only one.
        vary: tolerances in the place of those described, as text: ``{"torque_gain": "± 3 %"}``; "" for none.
        correlations: of pairs of quantities, ``{"leakage-displacement": 0.5}``, in the place of those described.
        machines: how many.
        seed: decides everything; the same seed gives the same machines.
        method: ``sobol``, which can be extended, or ``latin-hypercube``.
        duration: after which a work day begins no further move [s], or ``"6 min"``.
        visit_every: of a work day, time from one end stop to the next [s]; None: what the unit's requirement states, or
            45 s.
        require: what the position is required for, as `commission` takes it.

    Raises:
        DescriptionError: a tolerance has no meaning, correlations contradict each other, or there is no such duty.
        UnknownNameError: no such machine, unit or quantity.

    Example:
        >>> import ramsight
        >>> study = ramsight.Study("mining-loader", "lift-lower", unit="boom", machines=2, vary={"leakage": "± 10 %"})
        >>> study.quantities["leakage"]
        '1 ± 0.1 uniform'
        >>> found = study.run()
        >>> found.sizes["machine"], bool((found["largest"].max() < 0.2).item())
        (2, True)
    """

    @by_kind
    def __init__(
        self,
        machine: AnyMachine,
        duty: str | Path = "work-day",
        sensor: str = "kalman",
        *,
        unit: str | None = None,
        vary: Mapping[str, str] | None = None,
        correlations: Mapping[str, float] | None = None,
        machines: int = 1000,
        seed: int = 0,
        method: str = "sobol",
        duration: Quantity = 360.0,
        visit_every: Quantity | None = None,
        require: Quantity | Requirement | None = None,
    ) -> None:
        check_extra("study")
        self.machine = load_machine(machine)
        name = only_unit(self.machine) if unit is None else unit
        if correlations is not None:  # refused as those of a description are
            self.machine.replace({f"units.{name}.tolerances.correlations": dict(correlations)})
        self.requirement = required_unit(build(self.machine, name), require).requirement
        if require is not None and self.requirement is not None:
            self.machine = self.machine.replace({f"units.{name}.requirement": self.requirement})
        whole_argument(machines, "machines", 1, _MOST)
        whole_argument(seed, "seed", 0, 2**63 - 1)
        check_kind_of_sensor(sensor)
        visits = self._visits() if visit_every is None else visit_every
        work = Work(
            str(duty),
            argument(duration, "s", "duration", least="10 s", most="24 h"),
            argument(visits, "s", "visit_every", least="5 s", most="24 h"),
        )
        self.plan = plan(
            self.machine,
            name,
            work,
            sensor,
            vary=vary,
            correlations=correlations,
            count=machines,
            seed=seed,
            method=method,
        )

    def _visits(self) -> float:
        """Time from one reference to the next that a requirement states, or the usual one [s]."""
        asked = self.requirement
        return _VISIT_EVERY if asked is None or asked.visit_every >= DAY else asked.visit_every

    @property
    def quantities(self) -> dict[str, str]:
        """What varies, in SI, as text."""
        return {
            one.name: f"{one.spread.centre:.6g} ± {one.spread.half:.6g} {one.spread.distribution}"
            for one in self.plan.quantities
        }

    @by_kind
    def run(
        self, store: str | Path | None = None, client: Any = None, *, threads: int | None = None, progress: bool = False
    ) -> Dataset:
        """Run the machines that are not done yet.

        Args:
            store: folder of a Zarr store; a study that was stopped goes on in it, one with fewer machines is extended.
                None keeps everything in memory.
            client: of Dask distributed; None for threads of this process.
            threads: how many; by default one for each core that this process may use.
            progress: show a bar on a terminal if it takes long.

        Returns:
            Over `machine`: `largest`, `p95` [m], `samples` and more over `group` (of errors, by how many references
            came before), the `values` that were drawn, over `quantity` [SI], and what the sheet is made of.

        Raises:
            DescriptionError: that is no client, or so many threads there cannot be.
            RamsightError: the store is another study's, cannot be written, or a cluster is lost; nothing that was done
                is.
        """
        path = None if store is None else Path(store)
        check_client(client)
        if threads is not None:
            whole_argument(threads, "threads", 1, _MOST_THREADS)
        with advancing(self.plan.count, "machines", shown=progress) as advance:
            return run(self.plan, path, client=client, threads=threads, advance=advance)

    @by_kind
    def budget(
        self, base: int = 64, store: str | Path | None = None, client: Any = None, *, progress: bool = False
    ) -> Budget:
        """Which tolerance causes how much of the error's variance.

        Args:
            base: base points of Sobol's indices, a power of two; machines are so many times the quantities and two. 0
                for the linear budget alone, which takes a few replays of the sensor.
            store: folder of a Zarr store of its own, or None.
            client: of Dask distributed.
            progress: show a bar on a terminal if it takes long.

        Raises:
            DescriptionError: base is no power of two.
        """
        check_base(base)
        check_client(client)
        machines = base * (len(self.plan.quantities) + 2)
        with advancing(machines, "error budget", shown=progress and bool(base)) as advance:
            path = None if store is None else Path(store)
            return budget(self.plan, base, path, client=client, advance=advance)

    @by_kind
    def sensitivities(
        self, base: int = 64, store: str | Path | None = None, client: Any = None, *, progress: bool = False
    ) -> Dataset:
        """The error budget as a Dataset; arguments as `budget`'s.

        Returns:
            Over `quantity`: Sobol's `first` and `total` with the halves of their 95 % intervals, `linear_share` [1],
            and `linear`, what one standard deviation makes of the error [m].
        """
        return self.budget(base, store, client, progress=progress).dataset()

    @by_kind
    def datasheet(
        self, found: Dataset, budget: Budget | None = None, recorded: Sequence[tuple[str | Path, str | Path]] = ()
    ) -> Sheet:
        """What the machines say of the sensor.

        Args:
            found: of `run`.
            budget: of `budget`.
            recorded: drive logs with their true positions, files, to hold against the sheet.

        Returns:
            The sheet: `accuracy`, `terms`, `worst`, a summary `text`, and `to_json()`, `to_toml()`.

        Raises:
            LogError: a file cannot be read.
            DescriptionError: it is not what `run` returns.
        """
        if "machine" not in getattr(found, "dims", ()) or "outcome" not in found:
            raise DescriptionError("is no study that was run", key="found", value=found, allowed="what run() returns")
        sheet = data_sheet(self.plan, found, budget)
        held = [held_against(sheet, self.plan.bench, Path(log), Path(truth)) for log, truth in recorded]
        return replace(sheet, recorded=tuple(held))

    @by_kind
    def required(self, sheet: Sheet) -> SheetRequirement | None:
        """The sheet held against what the position is required for; None if that is not stated.

        Args:
            sheet: of `datasheet`.

        Returns:
            `is_met`, what is `missing`, what by the error budget would mend it (`mending`), and a `text`.
        """
        if self.requirement is None:
            return None
        judged = required(sheet, self.requirement, [])
        if judged.is_met:
            return judged
        return replace(judged, mending=tuple(mending(self.machine, self.plan, sheet.budget)))
