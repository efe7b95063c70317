"""Commands of a position control around a simple rod, recorded once: a change of the control must not move them.

The scenarios are drawn by their seeds: orders, a status of the sensor, faults of the drive's reports, a load. The rod
follows its drive, less the leakage, and stops at its ends. `python -m tests.golden_commands` records them again.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ramsight.control.position import PositionControl
from ramsight.control.trajectory import Limits
from ramsight.duty import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live_drive import LiveDrive
from ramsight.plant.drive import ServoDrive
from ramsight.plant.holding import Holding
from ramsight.plant.limits import limits_of
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .plant_bench import UNITS

FILE = Path(__file__).parent / "golden" / "control_commands.npz"
DT = 0.02
LOSSY = DriveResponse(0.05, 0.03, 10.0, 2, 300.0, lost=0.03, torque_repeats=0.05)
BOOM, RAM, BUCKET = (UNITS[name] for name in ("mining-loader boom", "press ram", "mining-loader bucket"))
SERVO = replace(BOOM, drive=ServoDrive("drive", BOOM.drive.inertia, 0.8, 16.0, 60.0))


@dataclass(frozen=True)
class Case:
    unit: object
    response: DriveResponse = IDEAL
    force: float = math.inf


CASES = {
    "boom": Case(BOOM, force=3e5),
    "press": Case(RAM),
    "forklift": Case(UNITS["forklift-mast lift"], DriveResponse(report_delay=0.06)),
    "axis": Case(UNITS["eha-test-bench axis"], DriveResponse(acceleration=150.0)),
    "servo": Case(SERVO),
    "bucket, lossy drive": Case(BUCKET, LOSSY),
    "press, 5 samples either way": Case(RAM, DriveResponse(command_delay=0.1, report_delay=0.1)),
}
VISITS = ("lowered", "lifted", "slow visit")
ORDERS = ("move", "move", "move", "slow move", *VISITS, "steer", "hold", "leak test", "stop", "")
STATUSES = (*[Status.OK] * 8, Status.REFERENCE_DUE, Status.NOT_REFERENCED, Status.INPUT_LOST, Status.TOO_UNCERTAIN)
REPORTS = ("silent", "no number", "speed stuck", "torque stuck", "half", "torque limit")
FAULTS = (*[""] * 5, *REPORTS, "rod held", "gives way")
SEEDS = range(5)
KEPT = 4  # every fourth speed is recorded: what is wrong once in a recursion stays so


class Scenario:
    """One run.

    Args:
        case: unit and drive.
        seed: of everything that is drawn.
    """

    def __init__(self, case: Case, seed: int) -> None:
        self.case, self.random = case, np.random.default_rng([seed, 77])
        self.control = PositionControl(
            case.unit, Limits.of(case.unit, force=case.force), period=DT, response=case.response
        )
        self.drive = LiveDrive(case.response, DT, DriveReport(seed=seed))
        self.stroke, self.full = case.unit.cylinder.stroke, limits_of(case.unit).load
        self.position, self.turns, self.k = float(self.random.uniform(0.1, 0.9)) * self.stroke, 0.0, 0
        self.load, self.holding = 0.3 * self.full, Holding(case.unit)
        self.said: list[tuple[float, str, str]] = []

    def order(self, what: str) -> None:
        control, speed = self.control, self.control.limits.speed
        if what in {"move", "slow move"}:
            goal = float(self.random.uniform(0.05, 0.95)) * self.stroke
            here = min(max(self.position + 0.04 * self.stroke * float(self.random.normal()), 0.0), self.stroke)
            target = goal if self.random.random() < 0.4 else here
            shares = (0.6, 0.7) if what == "slow move" else (1.0, 1.0)
            control.move_to(target, shares[0] * speed, shares[1] * control.limits.acceleration)
        elif what in VISITS:
            control.home(lifted=what == "lifted", slow=what == "slow visit")
        elif what in {"steer", "hold"}:
            control.steer(0.0 if what == "hold" else float(self.random.uniform(-1.2, 1.2)) * speed)
        elif what == "leak test" and self.holding.stands:
            control.leak_test()
        elif what == "stop":
            control.stop("asked to stop")

    def run(self, count: int, status: Status, fault: str) -> None:
        last = None
        for _ in range(count):
            report = self.drive.report(self.k * DT, self.turns, 20.0, 313.15 + 0.1 * (self.k % 50))
            if report is not None and fault:
                last = last or report
                report = {
                    "silent": None,
                    "no number": replace(report, motor_torque=math.nan),
                    "speed stuck": replace(report, motor_speed=last.motor_speed),
                    "torque stuck": replace(report, motor_torque=20.0),
                    "half": replace(report, motor_speed=0.5 * report.motor_speed),
                    "torque limit": replace(report, motor_speed=0.0, motor_torque=60.0 + 0.1 * (self.k % 3)),
                }.get(fault, report)
            self._step(report, status, fault)

    def _step(self, report, status: Status, fault: str) -> None:
        before = self.position
        leaks = 0.0 if self.holding.stands and self.turns == 0.0 else self.holding.leakage(self.load, 313.15)
        rate = self.case.unit.lift_sign * leaks
        ideal = (self.turns - rate) * self.holding.travel_per_radian(self.load)
        if fault == "gives way" and self.control.activity.name == "LANDING":
            ideal -= self.case.unit.lift_sign * 5e-3  # m/s
        if self.k and fault != "rod held":
            self.position = min(max(before + ideal * DT, 0.0), self.stroke)
        seen = self.position + 5e-5 * math.sin(1.7 * self.k)
        sensed = Estimate(seen, 1e-3, (self.position - before) / DT, self.load, status)
        if report is None:
            command = self.control.step_unreported()
        else:
            command = self.control.step(sensed, report, leak=1.05, displacement=0.99)
        self.turns, self.k = self.drive.follow(command.motor_speed), self.k + 1
        self.said.append((command.motor_speed, command.activity.name, command.reason))

    def play(self) -> list[tuple[float, str, str]]:
        """Motor speed [rad/s], activity and reason, sample by sample."""
        draw = self.random
        self.run(30, Status.OK, "")
        for _ in range(9):
            what = ORDERS[int(draw.integers(len(ORDERS)))]
            self.order(what)
            self.run(int(draw.integers(20, 180)), Status.OK, "")
            if draw.random() < 0.4:
                self.load = float(draw.uniform(-0.05, 0.6)) * self.full
            status, fault = STATUSES[int(draw.integers(len(STATUSES)))], FAULTS[int(draw.integers(len(FAULTS)))]
            self.run(int(draw.integers(60, 160)) if fault else int(draw.integers(5, 60)), status, fault)
        for lifted in (False, True):  # to an end from near it, and off it again
            end = self.control.end(lifted=lifted)
            self.position = abs(end - 0.06 * self.stroke)
            self.control.home(lifted=lifted)
            self.run(420, Status.OK, "rod held" if draw.random() < 0.2 else "")
            self.control.move_to(abs(end - 0.03 * self.stroke))
            self.run(150, Status.OK, "gives way")
        self.control.home()
        self.position = 0.5 * self.stroke
        self.run(400, Status.NOT_REFERENCED, "rod held")
        self.control.move_to(0.7 * self.stroke)
        self.run(150, Status.OK, "rod held")
        return self.said


def played(name: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Speeds [rad/s], and activity with reason as text where either changes: sample, text."""
    said = Scenario(CASES[name], seed).play()
    texts = [f"{activity}: {reason}" for _, activity, reason in said]
    changes = [f"{k} {text}" for k, text in enumerate(texts) if k == 0 or text != texts[k - 1]]
    return np.array([speed for speed, *_ in said]), np.array(changes)


def main() -> None:
    """Record all of them."""
    found = {}
    for name in CASES:
        for seed in SEEDS:
            speeds, changes = played(name, seed)
            found |= {f"{name} {seed} speeds": speeds[::KEPT], f"{name} {seed} changes": changes}
    FILE.parent.mkdir(exist_ok=True)
    np.savez_compressed(FILE, **found)


if __name__ == "__main__":
    main()
