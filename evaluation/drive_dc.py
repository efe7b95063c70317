"""Makes tests/traces/drive_dc.csv with motulator, which ramsight does not need: python evaluation/drive_dc.py.

A permanent-magnet synchronous motor of 2.2 kW under current vector control, fed by an inverter, under loads of both
signs at speeds of both signs; what a drive would report of it every 20 ms. Motor and control are motulator's (its
example of such a drive): copper losses in the windings, none in the iron and in the inverter.
"""

from __future__ import annotations

from pathlib import Path

import motulator.drive.control.sm as control
import numpy as np
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars

OUT = Path(__file__).parents[1] / "tests" / "traces" / "drive_dc.csv"
LENGTH, PERIOD, INERTIA = 12.0, 0.02, 0.015  # s, s, kg m2
LOAD = ([0.0, 1.0, 1.05, 3.0, 3.05, 5.0, 5.05, 8.0, 8.05, 12.0], [0.0, 0.0, 10.0, 10.0, 4.0, 4.0, -8.0, -8.0, 9.0, 9.0])
SPEED = (
    [0.0, 0.2, 0.8, 4.0, 4.6, 7.0, 7.8, 10.0, 10.5, 12.0],
    [0.0, 0.0, 120.0, 120.0, 60.0, 60.0, -110.0, -110.0, 140.0, 140.0],
)
NAMES = "time_s,motor_speed_rpm,motor_torque_nm,shaft_angle_deg,dc_power_w"


def main() -> None:
    """Simulate, and write what is reported."""
    motor = SynchronousMachinePars(n_p=3, R_s=3.6, L_d=0.036, L_q=0.051, psi_f=0.545)
    shaft = model.StiffMechanicalSystem(J=INERTIA, tau_L=lambda t: np.interp(t, *LOAD))
    drive = model.Drive(model.VoltageSourceConverter(u_dc=540), model.SynchronousMachine(motor), shaft)
    currents = control.CurrentReferenceCfg(motor, max_i_s=10.6, nom_w_m=2.0 * np.pi * 75.0)
    vector = control.CurrentVectorControl(motor, currents, J=INERTIA, T_s=250e-6, sensorless=False)
    vector.ref.w_m = lambda t: motor.n_p * np.interp(t, *SPEED)
    model.Simulation(drive, vector).simulate(t_stop=LENGTH)
    time, speed = shaft.data.t, shaft.data.w_M
    torque, current = drive.machine.data.tau_M, drive.machine.data.i_ss
    power = 1.5 * np.real(drive.converter.data.u_cs * np.conj(current))
    grid = np.arange(0.0, LENGTH, PERIOD)

    def sums(values: np.ndarray) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])

    def means(values: np.ndarray) -> np.ndarray:
        return np.concatenate([[0.0], np.diff(np.interp(grid, time, sums(values))) / PERIOD])

    rpm, angle = np.interp(grid, time, speed) * 30.0 / np.pi, np.degrees(np.interp(grid, time, sums(speed)))
    rows = np.column_stack([grid, rpm, means(torque), angle, means(power)])
    np.savetxt(OUT, rows, fmt=["%.2f", "%.1f", "%.3f", "%.2f", "%.1f"], delimiter=",", header=NAMES, comments="")


if __name__ == "__main__":
    main()
