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
    """A piston that may stand while oil is delivered."""

    since: Scalar = leaf("s")  # how long it may have stood [s]
    moved: Scalar = leaf("m")  # by which it seems to have moved since [m]
    delivered: Scalar = leaf("m")  # travel at constant load since [m]


@dataclass(frozen=True, kw_only=True)
class SettlingState:
    """A load that may settle on something else."""

    empty: Flag = leaf("1")  # whether the oil gave no force at the last sample, while it was lowered
    carried: Scalar = leaf("N")  # largest force of the oil lately [N]
    position: Scalar = leaf("m")  # where the oil carried it last [m]


@dataclass(frozen=True, kw_only=True)
class NearSettingState:
    """A pressure at which a relief valve may open, while nothing holds the piston yet."""

    lasts: Scalar = leaf("s")  # how long it has been so since it rose while the piston seemed to stand [s]
    position: Scalar = leaf("m")  # where the piston was when it began [m]


@dataclass(frozen=True, kw_only=True)
class ContactState:
    """What the piston does, and its contacts."""

    mode: Scalar = leaf("1")  # a number of `Mode`
    turned: Flag = leaf("1")  # whether the motor turned at the last sample
    since: Scalar = leaf("s")  # how long it has turned, or stood [s]
    left_from: Scalar = leaf("m")  # position from which the piston was released [m]
    held_at: Scalar = leaf("m")  # position at which it was held [m]
    went_on: Flag = leaf("1")  # whether it went on the way it came when it was released
    waits: Flag = leaf("1")  # whether a contact waits for its press to decide
    gone: Scalar = leaf("1", SEPARATE_CONTACTS)  # share of the stroke that it has moved since the last contact
    came: Scalar = leaf("m")  # way that it moved last, at most a hundredth or two of the stroke [m]
    standing: StandingState = field(default_factory=StandingState)  # whether it stands while oil is delivered
    # near_setting: whether the pressure is where a relief valve may open
    near_setting: NearSettingState = field(default_factory=NearSettingState)
    settling: SettlingState = field(default_factory=SettlingState)  # whether its load settles on something else
    release: ReleaseState = field(default_factory=ReleaseState)  # of a held piston
    press: PressState = field(default_factory=PressState)  # on what holds it

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
    """What is estimated of the piston when a contact is looked for."""

    position: Scalar  # after the load observer's step [m]
    std: Real  # standard deviation of it [m]
    known: Condition  # whether a position is known at all
    relief: Real  # how likely oil passes a relief valve, 0 to 1
    relief_tolerance: Real  # share of a pressure by which such a valve may hold it lower than described [1]
    compliance: Scalar  # factor of the compliance [1]
    compliance_std: Scalar  # standard deviation of it [1]
    load_change_std: Real  # standard deviation of the change of a load at rest [N]


@dataclass(frozen=True)
class ContactPlace:
    """A contact as evidence of a place."""

    found: Flag  # whether a contact has just been found
    evidence: Flag  # whether it is evidence of a place: another one than the last, and decided
    position: Scalar  # at which the piston came to stand [m]
    std: Scalar  # standard deviation of the position where only the oil's pressure shows it [m]
    at_top: Flag  # whether that is the extended end


@dataclass(frozen=True)
class Hold:
    """How the piston is held after a sample."""

    held: Flag  # whether it is
    released: Flag  # whether it has just been released
    went_on: Flag  # whether it has just gone on the way it came
    went_back: Flag  # whether it has just gone back
    press: PressState  # on what has held it
    stands: Flag  # whether it may stand while the pump delivers, not yet surely
    pushing: Flag  # whether the motor pushes against what holds it
    draws: Flag  # whether the pump draws oil from what is still held
    give_back: Scalar  # by which what holds it gives way under it, extension positive [m]
    went: Scalar  # way that a piston which is released may have moved while it seemed held [m]
    shown: Scalar  # share of what its oil did meanwhile that the torque shows [1]
    travel_std: Scalar  # standard deviation of the way that a held piston may have moved, drawn off or by leakage [m]


@dataclass(frozen=True)
class Contact:
    """Contacts at a sample."""

    place: ContactPlace  # a contact as evidence of a place
    hold: Hold  # how the piston is held
    mode: Scalar  # what the piston does after the sample, a number of `Mode`


def moved(state: ContactState, contact: Contact, position: Scalar, by: Scalar) -> ContactState:
    """The state with its positions moved by measurements.

    Args:
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
