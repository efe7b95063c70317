"""The control asks for what it asked for when its commands were recorded, in every scenario, sample by sample."""

import numpy as np
import pytest

from .golden_commands import CASES, FILE, KEPT, SEEDS, played


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", CASES)
def test_commands_are_the_recorded_ones(name, seed):
    speeds, changes = played(name, seed)
    with np.load(FILE) as recorded:
        assert changes.tolist() == recorded[f"{name} {seed} changes"].tolist()
        np.testing.assert_allclose(speeds[::KEPT], recorded[f"{name} {seed} speeds"], rtol=0.0, atol=1e-9 * 450.0)


def test_the_scenarios_have_all_activities_and_all_reasons_to_stop():
    with np.load(FILE) as recorded:
        texts = {text.split(" ", 1)[1] for key in recorded.files if key.endswith("changes") for text in recorded[key]}
    assert {text.split(":")[0] for text in texts} == {
        "RESTING", "MOVING", "LANDING", "MANUAL", "HOMING", "LEAK_TEST", "STOPPING", "STOPPED",
    }  # fmt: skip
    stops = "\n".join(text for text in texts if text.startswith("STOPPED"))
    for reason in (
        "asked",
        "invalid",
        "from where",
        "largest force",
        "no reference",
        "no report",
        "stuck",
        "commanded",
    ):
        assert reason in stops
