"""How long a log is, whatever its clock does."""

import math

import numpy as np
import pytest

from ramsight.tracking.availability import PassedTime

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("times", "lasts"),
    [
        ([0.0, 1.0, 2.0], 2.0), ([0.0, 1.0, -3589.0, -3588.0], 2.0), ([NAN, 1.0, NAN, 3.0, NAN], 2.0),
        ([NAN, NAN], 0.0), ([INF, 1.0, -INF, 2.0], 1.0), ([0.0, 1e8], 1e8), ([0.0, 1.001e8, 1.001e8 + 1.0], 1.0),
        ([-1.7e308, 1.7e308], 0.0), ([5.0], 0.0),
    ],
)  # fmt: skip
@pytest.mark.parametrize("piece", [1, 2, 100])
def test_only_finite_steps_forward_count(times, lasts, piece):
    passed = PassedTime()
    found = [passed.append(np.array(times[k : k + piece])) for k in range(0, len(times), piece)]
    assert passed.seconds == pytest.approx(lasts)
    assert (np.diff(np.concatenate(found)) >= 0.0).all()


def test_no_samples_take_no_time():
    passed = PassedTime()
    assert passed.append(np.array([])).size == 0
    assert passed.seconds == 0.0
