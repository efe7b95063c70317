"""Run a model through its segments and get the trajectory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.engine import kernel
from ramsight.engine.equation import OdeModel
from ramsight.engine.ode_module import FIRST_STEP, compile_ode


class Outcome(Enum):
    """How an integration ended."""

    DONE = "The run reached its end."
    TOO_MANY_STEPS = (
        "The run needed more than {limit} steps and stopped at {time:.6g} s. "
        "Raise max_steps, loosen rtol, or look for a very stiff or chattering part."
    )
    STEP_TOO_SMALL = (
        "The step size fell below what the time can resolve at {time:.6g} s; the error sits in state {state!r}. "
        "Check that part's parameters (a volume near zero, a stiffness far out of scale)."
    )
    NOT_FINITE = (
        "State {state!r} stopped being a finite number at {time:.6g} s. "
        "Check that part's parameters and that load and speed are within what it can carry."
    )

    def sentence(self, *, time: float = 0.0, state: str = "", limit: int = 0) -> str:
        """The text with the place filled in."""
        return self.value.format(time=time, state=state, limit=limit)


DEFAULT_RTOL = 1e-6
DEFAULT_MAX_STEPS = 20_000_000
_BUFFER = 16384  # accepted steps kept between two looks at the progress


@dataclass(frozen=True)
class Segments:
    """Piecewise-linear inputs: between corners every input is linear and every parameter constant."""

    # start, end: times [s], shape (n,); end of one is the start of the next
    start: Array
    end: Array
    value: Array  # inputs at each start, shape (n, inputs)
    slope: Array  # their slopes [1/s], shape (n, inputs)
    parameters: Array  # shape (1, parameters) or (n, parameters)

    def at(self, time: Array) -> tuple[NDArray[np.int64], Array]:
        """Segment of each time (the later one at a corner) and the inputs there, shape (times, inputs)."""
        row = np.clip(np.searchsorted(self.start, time, side="right") - 1, 0, len(self.start) - 1)
        return row, self.value[row] + self.slope[row] * (time - self.start[row])[:, None]


@dataclass(frozen=True)
class Trajectory:
    """What a run leaves."""

    outcome: Outcome  # how it ended; anything but `Outcome.DONE` means that the arrays end early
    message: str  # the outcome's sentence
    # time, state: states at the sample times, shapes (samples,), (samples, states)
    time: Array
    state: Array
    # step_time, step_state: states after every accepted step, the start included; empty if not recorded
    step_time: Array
    step_state: Array
    # accepted, rejected: number of steps
    accepted: int
    rejected: int


def integrate(
    model: OdeModel,
    initial: Array,
    segments: Segments,
    sample_time: Array,
    *,
    rtol: float = DEFAULT_RTOL,
    tolerance_scale: float = 1.0,
    max_step: float = np.inf,
    max_steps: int = DEFAULT_MAX_STEPS,
    record_steps: bool = False,
    advance: Callable[[float], object] | None = None,
) -> Trajectory:
    """Integrate a model from `initial` through all segments with Rodas4.

    Args:
        initial: states at the start, shape (states,).
        sample_time: times [s] at which states are wanted, increasing, within the segments.
        rtol: relative tolerance; the absolute ones are the states' own times `tolerance_scale`.
        tolerance_scale: factor on the states' absolute tolerances.
        max_step: largest step [s].

    Returns:
        The trajectory, also when the run failed: look at its outcome.
    """
    compiled = compile_ode(model)
    y = np.array(initial, dtype=np.float64)
    atol = np.array([np.inf if s.integral else s.tolerance * tolerance_scale for s in model.states])
    table = np.column_stack([segments.start, segments.end, segments.value])
    sample_time = np.ascontiguousarray(sample_time, dtype=np.float64)
    sample_state = np.empty((len(sample_time), len(y)))
    early = int(np.searchsorted(sample_time, segments.start[0], side="right"))
    sample_state[:early] = y
    progress = np.zeros(kernel.SLOTS)
    progress[kernel.TIME], progress[kernel.STEP] = segments.start[0], FIRST_STEP
    progress[kernel.SAMPLE], progress[kernel.BAD_STATE] = early, -1
    capacity = _BUFFER if record_steps else 0
    step_time, step_state = np.empty(capacity), np.empty((capacity, len(y)))
    kept_time, kept_state = [np.array([segments.start[0]])], [y[None].copy()]
    code = compiled.PAUSED
    while code == compiled.PAUSED and progress[kernel.ACCEPTED] + progress[kernel.REFUSED] < max_steps:
        before = progress[kernel.TIME]
        budget = min(float(max_steps), progress[kernel.ACCEPTED] + progress[kernel.REFUSED] + _BUFFER)
        code = compiled.integrate(
            table, segments.slope, segments.parameters, rtol, atol, max_step, y, progress, budget,
            sample_time, sample_state, step_time, step_state,
        )  # fmt: skip
        if record_steps:
            n = int(progress[kernel.RECORDED])
            kept_time.append(step_time[:n].copy())
            kept_state.append(step_state[:n].copy())
            progress[kernel.RECORDED] = 0
        if advance is not None:
            advance((segments.end[-1] if code == compiled.DONE else progress[kernel.TIME]) - before)
    outcome, message = _outcome(model, code, progress, max_steps)
    n = int(progress[kernel.SAMPLE])
    return Trajectory(
        outcome=outcome,
        message=message,
        time=sample_time[:n],
        state=sample_state[:n],
        step_time=np.concatenate(kept_time),
        step_state=np.concatenate(kept_state),
        accepted=int(progress[kernel.ACCEPTED]),
        rejected=int(progress[kernel.REFUSED]),
    )


def _outcome(model: OdeModel, code: int, progress: Array, max_steps: int) -> tuple[Outcome, str]:
    """How a run ended, and a sentence about it."""
    compiled = compile_ode(model)
    outcome = {
        compiled.DONE: Outcome.DONE,
        compiled.PAUSED: Outcome.TOO_MANY_STEPS,
        compiled.TOO_SMALL: Outcome.STEP_TOO_SMALL,
        compiled.NOT_FINITE: Outcome.NOT_FINITE,
    }[code]
    bad = int(progress[kernel.BAD_STATE])
    state = model.states[bad].name if bad >= 0 else ""
    return outcome, outcome.sentence(time=progress[kernel.TIME], state=state, limit=max_steps)


def outputs(model: OdeModel, segments: Segments, time: Array, state: Array) -> dict[str, Array]:
    """The model's outputs along a trajectory, by name, each of shape (times,)."""
    compiled = compile_ode(model)
    row, u = segments.at(time)
    slope = np.ascontiguousarray(segments.slope[row])
    held = np.minimum(row, len(segments.parameters) - 1)
    result = np.empty((len(time), len(model.outputs)))
    compiled.sample_outputs(
        np.ascontiguousarray(state), np.ascontiguousarray(u), slope, segments.parameters, held, result
    )
    return {output.name: result[:, k] for k, output in enumerate(model.outputs)}
