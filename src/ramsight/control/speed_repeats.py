"""Whether a speed repeats for longer than its declared noise lets it, while its command is steady or trembles.

The declaration has to be confirmed. How often one repeat is followed by another is learned from runs that ended, apart
for commands that are steady and that tremble within the noise of reports. Until as many samples were seen as a speed
without noise would need for `SURE_RUNS` alarms, no run is an alarm; and where more repeats follow than the noise
explains, their share counts in its place. A run that is too long for the declared noise and ends all the same refutes
the declaration: from then on no run is an alarm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ramsight.control.repeats import runs_of, upper_share
from ramsight.control.thresholds import NO_REPORT, SURE_RUNS
from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, count, negated

Pair = tuple[Flag, Flag]
"""Whether the command is steady, and whether it trembles; neither where it moves."""


@dataclass(frozen=True)
class Run:
    """Samples of the run that has not ended, for one kind of command: all, repeats, repeats after another."""

    samples: Scalar = leaf("1")
    repeats: Scalar = leaf("1")
    followed: Scalar = leaf("1")


@dataclass(frozen=True)
class Learned:
    """Of runs that ended, for one kind of command: samples, repeats that had a successor, and that repeated again."""

    samples: Scalar = leaf("1")
    seen: Scalar = leaf("1")
    met: Scalar = leaf("1")


@dataclass(frozen=True)
class Current:
    """The run that has not ended."""

    runs: tuple[Run, Run]  # for commands that are steady and that tremble
    speed: Scalar = leaf("rad/s", NO_REPORT)  # that repeats
    alarm: Flag = leaf("1")  # whether the run is too long
    repeated: Flag = leaf("1")  # whether the last sample was a repeat that counts


@dataclass(frozen=True)
class SpeedRepeats:
    """State of the check."""

    current: Current  # the run that has not ended
    learned: tuple[Learned, Learned]  # for commands that are steady and that tremble
    confirmed: Flag = leaf("1", 1.0)  # whether no run has refuted the declared noise


def no_run() -> Current:
    """Before a run."""
    return Current((Run(), Run()))


def nothing_learned() -> SpeedRepeats:
    """The state at power-up."""
    return SpeedRepeats(no_run(), (Learned(), Learned()))


def reset(state: SpeedRepeats, when: Flag) -> SpeedRepeats:
    """Count again, and learn nothing of the current run."""
    return replace(state, current=chosen(when, no_run(), state.current))


def look(
    state: SpeedRepeats, when: Flag, speed: Scalar, command: Pair, enough: float, period: float
) -> tuple[SpeedRepeats, Flag]:
    """The state after a report, and whether it is one too many of a run.

    Args:
        speed: reported [rad/s].
        period: of the samples [s].
    """
    same = all_of(when, speed == state.current.speed)
    ends = all_of(when, negated(speed == state.current.speed))
    state = _learn(state, all_of(ends, negated(state.current.alarm)), command, enough)
    before = chosen(ends, replace(no_run(), speed=speed), state.current)
    counted = [all_of(same, kind) for kind in command]
    runs = tuple(
        Run(
            run.samples + count(all_of(when, kind)),
            run.repeats + count(counts),
            run.followed + count(all_of(counts, before.repeated)),
        )
        for run, kind, counts in zip(before.runs, command, counted, strict=True)
    )
    found = [
        all_of(counts, state.confirmed, _too_long(run, learned, enough, period))
        for run, learned, counts in zip(runs, state.learned, counted, strict=True)
    ]
    alarm = any_of(before.alarm, *found)
    repeated = any_of(before.repeated, all_of(same, any_of(*command)))
    current = Current((runs[0], runs[1]), before.speed, alarm, repeated)
    return replace(state, current=current), all_of(when, alarm)


def _too_long(run: Run, learned: Learned, enough: float, period: float) -> Flag:
    """Whether a run is too long by the declared noise, and by what was seen: log(rate) / log(share) repeats."""
    share = upper_share(learned.met, learned.seen)
    sure = all_of(run.repeats >= enough, learned.samples >= SURE_RUNS * enough)
    return all_of(sure, share < 1.0, run.repeats >= runs_of(share, period))


def _learn(state: SpeedRepeats, when: Flag, command: Pair, enough: float) -> SpeedRepeats:
    """From a run that a new value ended, if it was no alarm."""
    current = state.current
    short = all_of(*(run.repeats < enough for run in current.runs))
    more = [
        Learned(
            learned.samples + run.samples,
            learned.seen + run.followed + count(all_of(current.repeated, kind)),
            learned.met + run.followed,
        )
        for learned, run, kind in zip(state.learned, current.runs, command, strict=True)
    ]
    taught = SpeedRepeats(current, (more[0], more[1]), all_of(state.confirmed, short))
    learned = chosen(when, (taught.learned, taught.confirmed), (state.learned, state.confirmed))
    return SpeedRepeats(current, *learned)
