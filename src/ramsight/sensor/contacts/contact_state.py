"""Contacts as they are kept from sample to sample, and as they are found."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Real, Scalar
from ramsight.sensor.contacts.contact_release import ReleaseState
from ramsight.sensor.contacts.mode import HELD, Mode, is_in
from ramsight.sensor.contacts.press import PressState
from ramsight.sensor.thresholds import SEPARATE_CONTACTS


@dataclass(frozen=True, kw_only=True)
class StandingState:
    """A piston that may stand while oil is delivered.

    Attributes:
        since: how long it may have stood [s].
        moved: by which it seems to have moved since [m].
        delivered: travel at constant load since [m].
    """

    since: Scalar = leaf("s")
    moved: Scalar = leaf("m")
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
class NearSettingState:
    """A pressure at which a relief valve may open, while nothing holds the piston yet.

    Attributes:
        lasts: how long it has been so since it rose while the piston seemed to stand [s].
        position: where the piston was when it began [m].
    """

    lasts: Scalar = leaf("s")
    position: Scalar = leaf("m")


@dataclass(frozen=True, kw_only=True)
class ContactState:
    """What the piston does, and its contacts.

    Attributes:
        mode: a number of `Mode`.
        turned: whether the motor turned at the last sample.
        since: how long it has turned, or stood [s].
        left_from: position from which the piston was released [m].
        held_at: position at which it was held [m].
        went_on: whether it went on the way it came when it was released.
        waits: whether a contact waits for its press to decide.
        gone: share of the stroke that it has moved since the last contact.
        came: way that it moved last, at most a hundredth or two of the stroke [m].
        standing: whether it stands while oil is delivered.
        near_setting: whether the pressure is where a relief valve may open.
        settling: whether its load settles on something else.
        release: of a held piston.
        press: on what holds it.
    """

    mode: Scalar = leaf("1")
    turned: Flag = leaf("1")
    since: Scalar = leaf("s")
    left_from: Scalar = leaf("m")
    held_at: Scalar = leaf("m")
    went_on: Flag = leaf("1")
    waits: Flag = leaf("1")
    gone: Scalar = leaf("1", SEPARATE_CONTACTS)
    came: Scalar = leaf("m")
    standing: StandingState = field(default_factory=StandingState)
    near_setting: NearSettingState = field(default_factory=NearSettingState)
    settling: SettlingState = field(default_factory=SettlingState)
    release: ReleaseState = field(default_factory=ReleaseState)
    press: PressState = field(default_factory=PressState)

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
        evidence: whether it is evidence of a place: another one than the last, and decided.
        position: at which the piston came to stand [m].
        std: standard deviation of the position where only the oil's pressure shows it [m].
        at_top: whether that is the extended end.
    """

    found: Flag
    evidence: Flag
    position: Scalar
    std: Scalar
    at_top: Flag


@dataclass(frozen=True)
class Hold:
    """How the piston is held after a sample.

    Attributes:
        held: whether it is.
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
        left_from=ca.if_else(hold.released, position, state.left_from + by),
        held_at=ca.if_else(hold.released, position - came_back, state.held_at + by),
        near_setting=replace(state.near_setting, position=state.near_setting.position + by),
        settling=replace(settling, position=settling.position + by),
    )
