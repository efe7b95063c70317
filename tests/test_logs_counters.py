"""A shaft's counter in the place of its speed: the travel that it counted, or the reason why nobody can know it."""

import numpy as np
import pytest

from ramsight.errors import LogError, LogWarning
from ramsight.logs import read_log

RPM = 2.0 * np.pi / 60.0
PERIOD = 0.02


def motion(period, fastest, duration, random):
    """Turns of a shaft that is driven to and fro with 100 rpm a ms at most, at times a period apart; and its speed."""
    time = np.arange(0.0, duration, period)
    fine = np.arange(0.0, duration + 1e-3, 1e-3)
    asked = fastest * random.choice([-1.0, -0.6, 0.0, 0.4, 1.0], size=int(duration / 2.0) + 2)
    speed = np.interp(fine, *ramped(asked, fastest))
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 1e-3)]) / (2.0 * np.pi)
    return time, np.interp(time, fine, turns), np.interp(time, fine, speed)


def ramped(asked, fastest):
    """Speeds for 2 s each, a tenth of a second from one to the next, from a standstill of 1 s on."""
    at, values, now = [0.0, 1.0], [0.0, 0.0], 1.0
    for value in asked:
        at += [now + 0.1, now + 2.0]
        values += [value, value]
        now += 2.0
    return at, values


def written(folder, time, counts, keys, speed=None):
    """A log of a counter, empty where it is NaN, and its map."""
    cells = ["" if value != value else f"{value:.0f}" for value in counts]
    beside = [""] * len(time) if speed is None else [f"{value / RPM:.2f}" for value in speed]
    rows = [f"{at:.6f},{cell},5,40,{n}" for at, cell, n in zip(time, cells, beside, strict=True)]
    (folder / "log.csv").write_text("\n".join(["t_s,count,M_nm,T_c,n_rpm", *rows]) + "\n")
    text = f'time = {{channel = "t_s"}}\nangle = {{channel = "count", {keys}}}\ntorque = {{channel = "M_nm"}}\n'
    text += 'temperature = {channel = "T_c"}\n' + ("" if speed is None else 'speed = {channel = "n_rpm"}\n')
    (folder / "map.toml").write_text(text)
    return folder / "log.csv", folder / "map.toml"


def turns_of(log):
    """How far the shaft went from the first sample on, and where it is not known."""
    speed = log.motor_speed.values
    return np.cumsum(np.nan_to_num(speed)) * PERIOD / (2.0 * np.pi), np.isfinite(speed)


def same_turns(log, time, turns, per_turn, unknown=0.0):
    found, is_known = turns_of(log)
    assert (~is_known).mean() <= unknown
    wanted = np.interp(log.time.values + 0.5 * PERIOD, time, turns) - np.interp(
        log.time.values[0] - 0.5 * PERIOD, time, turns
    )
    assert np.abs(found - wanted)[: int(np.argmin(is_known)) or None].max() <= 1.01 / per_turn + 1e-6


@pytest.mark.parametrize("missing", [1, 2, 20])
def test_empty_cells_cost_no_more_than_themselves(tmp_path, missing):
    time, turns, _ = motion(0.005, 1500.0 * RPM, 20.0, np.random.default_rng(1))
    counts = np.floor(turns * 4096.0) % 4096.0
    counts[1700 : 1700 + missing] = np.nan
    files = written(tmp_path, time, counts, "per_turn = 4096")
    if missing < 5:
        same_turns(read_log(*files), time, turns, 4096)
        return
    with pytest.warns(LogWarning, match=r"column count: does not say how far the shaft went in a gap from 8\.495 s to"):
        log = read_log(*files)
    assert 3 <= np.isnan(log.motor_speed.values).sum() <= 8
    place = int(np.flatnonzero(np.isnan(log.motor_speed.values))[-1]) + 1
    went = np.diff(np.interp(log.time.values[place:] - 0.5 * PERIOD, time, turns))
    np.testing.assert_allclose(
        np.cumsum(log.motor_speed.values[place:-1]) * PERIOD / (2.0 * np.pi), np.cumsum(went), atol=1e-3
    )


def test_half_a_turn_between_samples_is_refused_or_told_by_the_speed(tmp_path):
    time, turns, speed = motion(0.02, 1500.0 * RPM, 20.0, np.random.default_rng(2))
    counts = np.floor(turns * 4096.0) % 4096.0
    with pytest.raises(
        LogError, match=r"column count: the counter goes by more than a third of a turn between samples, first"
    ):
        read_log(*written(tmp_path, time, counts, "per_turn = 4096, modulus = 4096"))
    same_turns(read_log(*written(tmp_path, time, counts, "per_turn = 4096", speed)), time, turns, 4096)
    with pytest.raises(LogError, match=r"miss each other at .* % of the samples, first at 1\.\d+ s: sign"):
        read_log(*written(tmp_path, time, counts, "per_turn = 4096", -speed))


@pytest.mark.parametrize("bits", [16, 24, 32, 64])
@pytest.mark.parametrize("period", [0.02, 0.1])
def test_a_counter_that_does_not_begin_again_after_a_turn_is_not_folded(tmp_path, bits, period):
    time, turns, _ = motion(period, 1500.0 * RPM, 60.0, np.random.default_rng(3))
    counts = np.floor(turns * 1000.0)
    if bits < 64:
        counts = (counts + 0.9 * 2.0**bits) % 2.0**bits
    same_turns(read_log(*written(tmp_path, time, counts, "per_turn = 1000")), time, turns, 1000)


def test_a_counter_of_fewer_numbers_than_a_turn_has(tmp_path):
    time, turns, _ = motion(0.002, 300.0 * RPM, 20.0, np.random.default_rng(4))
    same_turns(
        read_log(*written(tmp_path, time, np.floor(turns * 1000.0) % 256.0, "per_turn = 1000")), time, turns, 1000
    )


def test_numbers_too_large_to_be_told_apart_are_refused(tmp_path):
    time = np.arange(200) * 0.02
    files = written(tmp_path, time, 2.0**63 + np.arange(200) * 4096.0, "per_turn = 1000")
    with pytest.raises(LogError, match=r"the counter reaches 9\.22e\+18, and numbers so large cannot be distinguished"):
        read_log(*files)


@pytest.mark.parametrize("per_turn", [1, 2])
def test_a_counter_of_one_a_turn_that_begins_again_says_nothing(tmp_path, per_turn):
    time, turns, _ = motion(0.005, 1500.0 * RPM, 10.0, np.random.default_rng(5))
    with pytest.raises(LogError, match=r"the counter (never changes|may be one|goes by more)"):
        read_log(*written(tmp_path, time, np.floor(turns * per_turn) % per_turn, f"per_turn = {per_turn}"))


def check_drawn(folder, number):
    """A counter that is drawn: right, or refused with a reason that fits."""
    random = np.random.default_rng(number)
    period = float(random.choice([0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]))
    fastest = float(random.choice([100.0, 500.0, 1500.0, 3000.0, 6000.0])) * RPM
    per_turn = int(random.choice([1, 2, 4, 6, 24, 100, 128, 360, 500, 1000]))
    kind = str(random.choice(["turn", "8", "16", "24", "32", "48", "64", "never"]))
    time, turns, speed = motion(period, fastest, 30.0 + 100.0 * period, random)
    counts = np.floor(turns * per_turn)
    if kind == "turn":
        counts = counts % per_turn
    elif kind != "never":
        counts = (counts + np.floor(random.random() * 2.0 ** int(kind))) % 2.0 ** int(kind)
    empty = random.random(len(counts)) < random.choice([0.0, 0.001, 0.01])
    counts[empty] = np.nan
    is_beside = bool(random.random() < 0.3)
    files = written(folder, time, counts, f"per_turn = {per_turn}", speed if is_beside else None)
    import warnings

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "(?s).*does not say how far the shaft went", LogWarning)
        try:
            log = read_log(*files)
        except LogError as error:
            return str(error).partition("the counter ")[2][:24]
    found, is_known = turns_of(log)
    ends = log.time.values + 0.5 * PERIOD
    first, lost = int(np.argmax(is_known)), np.flatnonzero(~is_known[int(np.argmax(is_known)) :])
    place = np.minimum(np.searchsorted(time, ends - 1e-6), len(time) - 1)
    comes = (np.abs(time[place] - ends) < 1e-6) & ~empty[place]  # between its samples nobody knows where a counter was
    comes &= (np.arange(len(ends)) >= first) & (
        np.arange(len(ends)) < first + (int(lost[0]) if lost.size else len(ends))
    )
    begin = int(np.argmax(comes))
    off = (found - found[begin]) - (turns[place] - turns[place[begin]])
    assert np.abs(off[comes]).max() <= 1.01 / per_turn + 1e-6, (period, fastest / RPM, per_turn, kind, is_beside)
    assert lost.size <= (0.5 if is_beside else 0.1) * len(off) or empty.mean() > 0.005
    return ""


@pytest.mark.parametrize("number", [*range(40), 72, 5205, 5370])  # the last: whole turns between samples
def test_a_drawn_counter_is_right_or_refused(tmp_path, number):
    said = check_drawn(tmp_path, number)
    assert said == "" or said.split(" ")[0] in ("goes", "may", "needs", "never", "and", "reaches"), said
