"""How a run can end. Each member's text is the sentence for the user, with the remedy."""

from __future__ import annotations

from enum import Enum


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
