"""What to say of a simulated run."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray

_SHOWN = 1e-3  # share of the largest energy below which a line is left out


def run_summary(run: xarray.Dataset) -> str:
    """Travel, torque, where the energy went and how well the balances close, as lines of text."""
    position, torque = run["position"].values, run["motor_torque"].values
    energies = {name.removeprefix("energy."): value for name, value in run.attrs.items() if name.startswith("energy.")}
    lines = [
        f"{run.attrs['unit']}: {run['time'].values[-1]:.1f} s in {run.attrs['accepted_steps']} steps; position "
        f"{1e3 * position[0]:.1f} mm at first, {1e3 * position.min():.1f} to {1e3 * position.max():.1f} mm, "
        f"{1e3 * position[-1]:.1f} mm at last; motor torque {torque.min():.1f} to {torque.max():.1f} N m",
        f"energy [kJ]: the motor gave {energies.pop('shaft_given') / 1e3:.2f} and took "
        f"{energies.pop('shaft_taken') / 1e3:.2f} back; of the difference {energies.pop('shaft') / 1e3:.2f} went to",
    ]
    largest = max(abs(value) for value in energies.values())
    for name, value in sorted(energies.items(), key=lambda item: -abs(item[1])):
        if abs(value) >= _SHOWN * largest:
            lines.append(f"  {value / 1e3:10.3f}  {name.replace('_', ' ').replace('.', ': ')}")
    if "electrical_energy_given" in run.attrs:
        given, recovered = run.attrs["electrical_energy_given"], run.attrs["electrical_energy_recovered"]
        lines.append(f"battery [kJ]: gave {given / 1e3:.2f}, took {recovered / 1e3:.2f} back")
    lines.append(
        f"balances: energy closes to {100 * abs(run.attrs['energy_residual']):.2g} %, "
        f"volume to {100 * abs(run.attrs['volume_residual']):.2g} %"
    )
    return "\n".join(lines)
