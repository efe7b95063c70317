"""A flood on the bus is no flood of log lines."""

import logging

from ramsight.deploy.encoder.runner import Limit, limited_log_lines


def line(text, *values, name="can"):
    return logging.LogRecord(name, logging.WARNING, "", 0, text, values, None)


def test_lines_of_a_kind_are_limited_and_those_held_back_are_counted():
    now = [0.0]
    limit = Limit(clock=lambda: now[0])
    assert [limit.filter(line("lost %d", k)) for k in range(10)] == [True] * 3 + [False] * 7
    assert limit.filter(line("another"))
    now[0] = 10.0
    late = line("lost %d", 10)
    assert limit.filter(late)
    assert late.getMessage() == "lost 10 (and 7 more since the last such line)"
    assert not limit.filter(line("lost %d", 11))


def test_lines_that_are_all_different_are_limited_too():
    limit = Limit(clock=lambda: 0.0)
    passed = sum(limit.filter(line(f"frame {k} is lost")) for k in range(100_000))
    assert passed < 100


def test_a_day_of_flood_stays_small():
    now = [0.0]
    limit, passed = Limit(clock=lambda: now[0]), 0
    for _ in range(100_000):
        now[0] += 0.01
        passed += limit.filter(line("lost"))
    assert passed < 110


def test_the_limit_is_there_while_an_encoder_serves(capsys):
    with limited_log_lines():
        for k in range(1000):
            logging.getLogger("can.bus").warning("lost %d", k)
    assert capsys.readouterr().err.splitlines() == [f"can.bus: lost {k}" for k in range(3)]
