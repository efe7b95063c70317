"""Contacts as they are kept from sample to sample, and as they are found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, scalar
from ramsight.sensor.contact_release import ReleaseState
from ramsight.sensor.mode import HELD, Mode, is_in
from ramsight.sensor.pressing import PressState
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.thresholds import SEPARATE_CONTACTS


@dataclass(frozen=True, kw_only=True)
class StandingState:
    """A piston that may stand while oil is delivered.

    Attributes:
        since: how long it may have stood [s].
        moved: by which it seems to have moved since [m].
        moved_by: derivatives of that with respect to what a step is made with.
        delivered: travel at constant load since [m].
    """

    since: Scalar = leaf("s")
    moved: Scalar = leaf("m")
    moved_by: Mapping[Quantity, Scalar] = leaf("m", None)
    delivered: Scalar = leaf("m")


@dataclass(frozen=True, kw_only=True)
class SettlingState:
    """A load that may settle on something else.

    Attributes:
        empty: whether the oil gave no force at the last sample, while it was lowered.
        carried: largest force of the oil lately [N].
        position: where the oil carried it last [m].
    """

    empty: Flag = leaf("1")
    carried: Scalar = leaf("N")
    position: Scalar = leaf("m")


@dataclass(frozen=True, kw_only=True)
class PendingState:
    """A contact found at rest or by a motor that brakes, which is no evidence of a place yet.

    Attributes:
        waits: whether there is one.
        turned: whether the motor has turned since it was found.
        torque: expected when it was found [N m].
    """

    waits: Flag = leaf("1")
    turned: Flag = leaf("1")
    torque: Scalar = leaf("N m")


@dataclass(frozen=True, kw_only=True)
class ContactState:
    """What the piston does, and its contacts.

    Attributes:
        mode: a number of `Mode`.
        turned: whether the motor turned at the last sample.
        since: how long it has turned, or stood [s].
        left_from: position from which the piston was released [m].
        leaves_way: in which the motor pulls it off, +1 for extension; 0 if it does not.
        held_at: position at which it was held [m].
        went_on: whether it went on the way it came when it was released.
        gone: share of the stroke that it has moved since the last contact.
        came: way that it moved last, at most a hundredth or two of the stroke [m].
        standing: whether it stands while oil is delivered.
        settling: whether its load settles on something else.
        pending: a contact found at rest.
        release: of a held piston.
        press: on what holds it.
    """

    mode: Scalar = leaf("1")
    turned: Flag = leaf("1")
    since: Scalar = leaf("s")
    left_from: Scalar = leaf("m")
    leaves_way: Scalar = leaf("1")
    held_at: Scalar = leaf("m")
    went_on: Flag = leaf("1")
    gone: Scalar = leaf("1", SEPARATE_CONTACTS)
    came: Scalar = leaf("m")
    standing: StandingState
    settling: SettlingState = field(default_factory=SettlingState)
    pending: PendingState = field(default_factory=PendingState)
    release: ReleaseState = field(default_factory=ReleaseState)
    press: PressState = field(default_factory=PressState)

    @classmethod
    def initial(cls, stepping: tuple[Quantity, ...] = ()) -> ContactState:
        """Before the first sample.

        Args:
            stepping: quantities that a step of the balance is made with.
        """
        return cls(standing=StandingState(moved_by=dict.fromkeys(stepping, scalar(0.0))))

    @property
    def held(self) -> Flag:
        """Whether the piston is held."""
        return is_in(self.mode, HELD)

    @property
    def leaves(self) -> Flag:
        """Whether it was released, and may still stand there."""
        return is_in(self.mode, (Mode.LEAVING,))

    @property
    def direction(self) -> Scalar:
        """In which a held piston cannot go on, +1 for extension."""
        return ca.if_else(self.mode == float(Mode.HELD_EXTENDING), 1.0, -1.0)

    def off_stop(self, position: Scalar) -> Scalar:
        """A position that is not beyond the stop that the motor pulls the piston off [m]."""
        way, left_from = self.leaves_way, self.left_from
        kept = ca.if_else(way > 0.0, ca.fmax(position, left_from), ca.fmin(position, left_from))
        return ca.if_else(all_of(self.leaves, way != 0.0), kept, position)


@dataclass(frozen=True)
class Estimated:
    """What is estimated of the piston when a contact is looked for.

    Attributes:
        position: after the load observer's step [m].
        std: standard deviation of it [m].
        known: whether a position is known at all.
        relief: how likely oil passes a relief valve, 0 to 1.
        relief_tolerance: share of a pressure by which such a valve may hold it lower than described [1].
        compliance: factor of the compliance [1].
        compliance_std: standard deviation of it [1].
        load_change_std: standard deviation of the change of a load at rest [N].
    """

    position: Scalar
    std: Real
    known: Condition
    relief: Real
    relief_tolerance: Real
    compliance: Scalar
    compliance_std: Scalar
    load_change_std: Real


@dataclass(frozen=True)
class ContactPlace:
    """A contact as evidence of a place.

    Attributes:
        found: whether a contact has just been found.
        evidence: whether it is evidence of a place: another one than the last, and no longer pending.
        position: at which the piston came to stand [m].
        by: derivatives of the way that it seemed to move since, with respect to what a step is made with.
        went_on: whether it moved that way all the same: it was on an end, and leaves it.
        std: standard deviation of the position where only the oil's pressure shows it [m].
        at_top: whether that is the extended end: the one that it moved to, or the one that it leaves.
    """

    found: Flag
    evidence: Flag
    position: Scalar
    by: Row
    went_on: Flag
    std: Scalar
    at_top: Flag


@dataclass(frozen=True)
class Hold:
    """How the piston is held after a sample.

    Attributes:
        held: whether it is.
        leaves: whether it has just been released, or is pulled off an end.
        released: whether it has just been released.
        went_on: whether it has just gone on the way it came.
        went_back: whether it has just gone back.
        press: on what has held it.
        stands: whether it may stand while the pump delivers, not yet surely.
        pushing: whether the motor pushes against what holds it.
        draws: whether the pump draws oil from what is still held.
        give_back: by which what holds it gives way under it, extension positive [m].
        went: way that a piston which is released may have moved while it seemed held [m].
        shown: share of what its oil did meanwhile that the torque shows [1].
        travel_std: standard deviation of the way that a held piston may have moved, drawn off or by leakage [m].
    """

    held: Flag
    leaves: Flag
    released: Flag
    went_on: Flag
    went_back: Flag
    press: PressState
    stands: Flag
    pushing: Flag
    draws: Flag
    give_back: Scalar
    went: Scalar
    shown: Scalar
    travel_std: Scalar


@dataclass(frozen=True)
class Contact:
    """Contacts at a sample.

    Attributes:
        place: a contact as evidence of a place.
        hold: how the piston is held.
        mode: what the piston does after the sample, a number of `Mode`.
    """

    place: ContactPlace
    hold: Hold
    mode: Scalar


def moved(state: ContactState, contact: Contact, position: Scalar, by: Scalar) -> ContactState:
    """The state with its positions moved by measurements.

    Args:
        state: after the sample, before measurements.
        contact: of the sample.
        position: after all measurements [m].
        by: by how much they moved it [m].
    """
    hold, settling = contact.hold, state.settling
    came_back = ca.if_else(hold.released, hold.give_back, 0.0)
    return replace(
        state,
        left_from=ca.if_else(hold.leaves, position, state.left_from + by),
        held_at=ca.if_else(hold.leaves, position - came_back, state.held_at + by),
        settling=replace(settling, position=settling.position + by),
    )
