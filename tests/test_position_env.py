"""A unit as an environment of gymnasium."""

import sys

import numpy as np
import pytest

import ramsight
from ramsight.api.position_env import _Episode


def test_without_gymnasium_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(ramsight.RamsightError, match=r"ramsight\[gym\]"):
        ramsight.position_env("press")


@pytest.fixture
def episode():
    return _Episode(ramsight.build("press"), 1.0, None, ramsight.DriveResponse(lost=0.5), 0.02)


def test_an_episode_begins_with_a_reset_and_options_that_are_known(episode):
    with pytest.raises(ramsight.RamsightError, match=r"reset\(\)"):
        episode.go_on(0.1)
    with pytest.raises(ramsight.UnknownNameError, match="unknown option 'laod'; did you mean 'load'"):
        episode.begin(np.random.default_rng(1), {"laod": "80 kN"})


def test_nothing_of_an_episode_is_left_in_the_next(episode):
    options = {"start": "100 mm", "target": 0.15, "load": "80 kN"}

    def seen():
        first, _ = episode.begin(np.random.default_rng(1), options)
        return np.array([first, *(episode.go_on(0.5)[0] for _ in range(10))])

    np.testing.assert_array_equal(seen(), seen())
    cut = [episode.go_on(0.0)[3] for _ in range(40)]
    assert cut == [False] * 39 + [True], "1 s after 50 samples of 20 ms"
    fastest = max(episode.go_on(5.0)[4]["sample"].motor_speed for _ in range(20))
    assert fastest == pytest.approx(ramsight.build("press").max_speed)


@pytest.fixture(scope="module")
def env():
    pytest.importorskip("gymnasium")
    return ramsight.position_env("press", duration="4 s", as_built=ramsight.AsBuilt(leak=1.1))


@pytest.mark.filterwarnings(
    "ignore:.*Box observation space:UserWarning", "ignore:.*not within the observation:UserWarning"
)
def test_it_is_what_gymnasium_asks_for(env):
    from gymnasium.utils.env_checker import check_env

    check_env(env, skip_render_check=True)


def test_a_simple_policy_brings_the_rod_to_the_target(env):
    seen, _ = env.reset(seed=3, options={"start": "100 mm", "target": 0.15, "load": "80 kN"})
    rewards, cut = [], False
    while not cut:
        seen, reward, ended, cut, info = env.step([np.clip(20.0 * (seen[4] - seen[0]), -1.0, 1.0)])
        rewards.append(reward)
        assert not ended
    assert len(rewards) == 200
    assert rewards[-1] > 0.1 * rewards[0]
    assert info["sample"].position == pytest.approx(0.15, abs=0.01)
    assert seen[0] * 0.4 == pytest.approx(info["estimate"].position)
    assert rewards[-1] == pytest.approx(-abs(info["sample"].position - 0.15) / 0.4)


def test_a_seed_decides_the_episode(env):
    first, again, other = (env.reset(seed=seed)[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    with pytest.raises(ramsight.DescriptionError, match="target"):
        env.reset(options={"target": "2 m"})
