"""The measured open loop of docs/explanation/control-concept.md: margins and phase of a loop that is known."""

from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture
def module(script):
    return script("loop_response")


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.22, 0.3])
def test_margins_and_phase_of_an_integrator_with_a_dead_time(module, delay):
    frequency = np.array(module.PERIODS) / module.WINDOW
    turning = 2.0 * np.pi * frequency
    gain = 1.5 / (1j * turning) * np.exp(-1j * turning * delay)
    found = module.Response(frequency, gain, delay=delay)
    assert np.allclose(found.phase, -0.5 * np.pi - turning * delay)
    assert found.crossover == pytest.approx(1.5 / (2.0 * np.pi), rel=1e-6)
    assert found.phase_margin == pytest.approx(90.0 - np.degrees(1.5 * delay), abs=1.0)
    if delay > 0.0:  # where the phase is -180 degrees the gain is 2 delay 1.5 / pi
        assert found.gain_margin == pytest.approx(np.pi / (2.0 * delay * 1.5), rel=0.05)
