"""Descriptions that somebody else may have written: whatever they hold, one clear line, soon, in little memory."""

import os
import re
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest

from ramsight import bounded_toml, machine
from ramsight.bounded_toml import DEEPEST, LARGEST, LONGEST_WORD, MOST, TomlError
from ramsight.errors import MISTAKES, DescriptionError, RamsightError, first_of
from ramsight.logs.channel_map import load_map
from ramsight.machine.declare import Quantity, declaration
from ramsight.machine.parts import PARTS
from ramsight.machine.placed import KINDS
from ramsight.machine.pump_description import COLUMNS, read_efficiencies
from ramsight.studio import draft
from ramsight.units import parse

TEXT = machine.template()


def many(line: str, count: int) -> str:
    return "\n".join(line.format(k) for k in range(count)) + "\n"


HOSTILE = {
    "dots": ".".join("a" * 50_000) + " = 1",
    "dots in a header": "[" + ".".join("a" * 50_000) + "]",
    "dots with spaces": " . ".join("a" * 20_000) + " = 1",
    "quoted dots": ".".join(['"a"'] * 50_000) + " = 1",
    "an array of tables": "[[" + ".".join("a" * 50_000) + "]]",
    "brackets": "a = " + "[" * 100_000,
    "braces": "a = " + "{a = " * 50_000,
    "a long integer": TEXT.replace("format = 1", "format = " + "1" * 5000),
    "a long hexadecimal": TEXT.replace("format = 1", "format = 0x" + "f" * 5000),
    "an integer of 900 digits": TEXT.replace("format = 1", "format = " + "1" * 900),
    "a million keys": many("k{} = 1", 10**6),
    "19000 keys": TEXT + many("k{} = 1", 19_000),
    "2000 bare units": 'format = 1\nname = "x"\n' + many("[units.u{}]", 2000),
    "99 bare units": 'format = 1\nname = "x"\n' + many("[units.u{}]", 99),
    "headers": many("[t{}.a.b.c.d.e.f.g.h.i.j.k]", 19_000),
    "a long key": '"' + "a" * 900_000 + '" = 1',
    "a key of two lines": TEXT + '"a\\nb" = 1',
    "a long value": TEXT.replace("format = 1", 'format = "' + "x" * 900_000 + '"'),
    "a long number in text": TEXT.replace('"127 mm"', '"' + "1" * 900_000 + ' mm"'),
    "2000 units in a value": TEXT.replace('"127 mm"', '"1 ' + "m " * 2000 + '"'),
    "spaces in a tolerance": TEXT.replace('"127 mm"', '"127 mm ±' + " " * 90_000 + 'x"'),
    "a small exponent": TEXT.replace('"127 mm"', '"1e-99999999999999999999 mm"'),
    "digits of another script": TEXT.replace('"127 mm"', '"\u0661\u0662\u0667 mm"'),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_one_clear_line_within_two_seconds(name):
    begin = time.process_time()
    with pytest.raises(RamsightError) as caught:
        machine.loads(HOSTILE[name], "a.toml")
    assert time.process_time() - begin < 2.0
    lines = [str(one) for one in (caught.value, *caught.value.others)]
    assert len(lines) <= MISTAKES + 1
    assert "a.toml" in lines[0]
    assert all(line.isprintable() and len(line) < 800 for line in lines)


PEAK = """
import atexit, re, runpy, sys
from pathlib import Path
atexit.register(lambda: print(re.search(r"VmHWM:\\s*([0-9]+) kB", Path("/proc/self/status").read_text())[1]))
sys.argv = ["ramsight", "check", sys.argv[1]]
runpy.run_module("ramsight", run_name="__main__")
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (r'title = "x\u001b[31m"', r"\u001b"), (r'title = "\u0000"', r"\u0000"),
        (r'title = "\U0000001B"', r"\U0000001B"), (r'"key\u0007" = 1', r"\u0007"), (r'title = "\u009b"', r"\u009b"),
        (r'title = "a\rb"', r"\r"), ('title = """\n\\u007f"""', r"\u007f"),
    ],
)  # fmt: skip
def test_a_text_that_commands_a_terminal_is_refused(text, said):
    with pytest.raises(TomlError, match=re.escape(f"control character {said}")) as refused:
        bounded_toml.loads("a = 1\n" + text)
    assert refused.value.line == (3 if '"""' in text else 2)


@pytest.mark.parametrize("text", [r'a = "one\ntwo\t"', r'a = "\\u001b"', "a = '\\u001b'", r'a = "\u00b2"', r'a = "\""'])
def test_a_text_with_lines_or_a_backslash_is_none(text):
    assert bounded_toml.loads(text)["a"]


@pytest.mark.parametrize("key", ["name", "title"])
@pytest.mark.parametrize("text", [r"a\nb", r"a\tb", "a\u202eb", "a\u2028b"])
def test_a_heading_is_a_line(key, text):
    changed = re.sub(rf"(?m)^{key} = .*$", lambda _: f'{key} = "{text}"', TEXT, count=1)
    assert changed != TEXT
    with pytest.raises(DescriptionError, match=f"{key}: holds the end of a line"):
        machine.loads(changed, "a.toml")


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="only Linux says the peak so")
def test_little_memory(tmp_path):
    """Each in a process of its own, which says its own peak; the command alone takes about 110 MiB.

    What the system says of a child (ru_maxrss) begins with the peak of the process that starts it.
    """
    for name in ("dots", "dots in a header", "a million keys", "19000 keys", "headers", "braces"):
        file = tmp_path / "a.toml"
        file.write_text(HOSTILE[name])
        done = subprocess.run([sys.executable, "-c", PEAK, str(file)], capture_output=True, check=False)
        assert done.returncode == 2
        assert done.stderr.startswith(b"error: "), done.stderr[:200]
        assert int(done.stdout.split()[-1]) >> 10 < 300, name


def test_a_text_is_read_up_to_its_limits_and_not_beyond():
    def reads(text):
        try:
            bounded_toml.loads(text)
        except TomlError:
            return False
        return True

    assert reads(".".join("a" * DEEPEST) + " = 1")
    assert not reads(".".join("a" * (DEEPEST + 1)) + " = 1")
    assert reads("a = " + "[" * (DEEPEST - 1) + "]" * (DEEPEST - 1))
    assert not reads("a = " + "[" * DEEPEST + "]" * DEEPEST), "with the table around it one too many"
    assert not reads("a.b.c.d.e.f.g.h = [[[[[[[[[1]]]]]]]]]"), "both together"
    assert reads(many("k{} = 1", MOST))
    assert not reads(many("k{} = 1", MOST + 1))
    assert reads("a" * LONGEST_WORD + " = 1")
    assert not reads("a" * (LONGEST_WORD + 1) + " = 1")
    assert reads("#" + "x" * (LARGEST - 1))
    assert not reads("#" + "x" * LARGEST)


@pytest.mark.parametrize(
    "text",
    [
     'a = """' + "." * 100 + "[" * 100 + '"""',
     "a = '''" + "=" * 30_000 + "'''", "# " + "." * 100, 'a = "' + "[.=" * 9000 + '"',
     '"a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r" = 1', "a = '\\'\n" + "b.c = '\"'\n", 'a = "\\"...................."',
     'a = """\\""".................."""', many("a.b{} = 1.5", 100)],
)  # fmt: skip
def test_what_stands_in_quotes_and_comments_does_not_count(text):
    import tomllib

    assert bounded_toml.loads(text) == tomllib.loads(text)


@pytest.mark.parametrize(
    "text", ['a = "x', 'a = """x', "a = '", "a = '''x''", 'a = "x\n', '"', "\x00", "a = 1979-02-31", "]", "}"]
)
def test_what_is_no_toml_is_said_with_its_line(text):
    with pytest.raises(TomlError) as caught:
        bounded_toml.loads("# one\n" + text)
    assert caught.value.line >= 1


def test_a_channel_map_and_the_studio_have_the_same_limits(tmp_path):
    (tmp_path / "map.toml").write_text(HOSTILE["dots"])
    with pytest.raises(DescriptionError, match=r"map\.toml: is no TOML file: nested too deeply"):
        load_map(tmp_path / "map.toml")
    assert "nested too deeply" in draft.can_be_read(HOSTILE["dots"]).words
    os.truncate(tmp_path / "map.toml", 1 << 40)
    with pytest.raises(DescriptionError, match="is no TOML file: too large"):
        load_map(tmp_path / "map.toml")


def test_a_few_dozen_mistakes_are_listed():
    def errors(count):
        return [DescriptionError("is wrong", key=f"k{k}") for k in range(count)]

    assert len(first_of(errors(MISTAKES)).others) == MISTAKES - 1
    longer = first_of(errors(MISTAKES + 7))
    assert len(longer.others) == MISTAKES
    assert str(longer.others[-1]) == "and 7 more mistakes"


def declared() -> list[tuple[str, Quantity]]:
    """Every quantity of every part that a description can hold."""
    found, left, seen = [], [machine.Machine, *PARTS.values(), *KINDS.values()], set()
    while left:
        model = left.pop()
        if model in seen:
            continue
        seen.add(model)
        left += [one for one in machine.base.Part.__subclasses__() if one not in seen]
        left += [one for known in list(seen) for one in known.__subclasses__() if one not in seen]
        for name, field in model.model_fields.items():
            if (one := declaration(field)) is not None:
                found.append((f"{model.__name__}.{name}", one))
    return found


def test_every_quantity_has_a_least_and_a_greatest_value():
    quantities = declared()
    assert len(quantities) > 150
    for name, one in quantities:
        low, high = one.least or one.above, one.most or one.below
        assert low is not None, name
        assert high is not None, name
        if one.above is not None:
            assert parse(one.above, one.unit) != 0.0, f"{name}: a least value, not above 0"
        unit = one.unit.removeprefix("delta_")
        for wild in ("1e300", "-1e300", *([] if unit == "degC" else ["1e-300"])):
            with pytest.raises(DescriptionError):
                one.read(f"{wild} {unit}" if unit != "1" else wild, from_file=True)


def test_a_value_that_is_almost_0_is_refused_and_0_is_not():
    friction = Quantity("kN", "friction", least="0 kN", most="1000 kN")
    assert friction.read("0 kN") == 0.0
    assert friction.read("1e-12 kN") == 1e-9
    for text in ("9e-13 kN", "1e-300 kN"):
        with pytest.raises(DescriptionError, match="too small to be anything but 0"):
            friction.read(text)


@pytest.mark.parametrize(
    ("row", "says"),
    [("100, 1500, 46, 0.95, 0.92", ""), ("1e-300, 1500, 46, 0.9, 0.9", "out of range"),
     ("100, 1500, 46, 0.9, 1.01", "out of range"),
     ("100, \u0661, 46, 0.9, 0.9", "not five numbers"), ('100, "' + "x" * 200_000 + '", 46, 0.9, 0.9', "no CSV text"),
     ("100, 1500, 46, 0.9, 0.0009", "out of range"), ("10001, 1500, 46, 0.9, 0.9", "out of range")],
)  # fmt: skip
def test_a_table_of_efficiencies_has_limits_too(row, says):
    text = ",".join(COLUMNS) + "\n" + row
    if not says:
        assert np.shape(read_efficiencies(text).volumetric) == (1, 1, 1)
        return
    with pytest.raises(Exception, match=says):
        read_efficiencies(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["mining-loader", "mining-loader-in-service", "forklift-mast", "press", "eha-valve-rig"]
)
def test_a_check_of_values_at_their_ends_gives_no_traceback(name):
    """Two to twenty values of a unit at the ends of their ranges: a table of what follows, or one line."""
    from ramsight.machine.base import walk
    from ramsight.plant.machine_tables import machine_summary

    rng, described = np.random.default_rng(1), machine.load_machine(name)
    for _ in range(40):
        key = str(rng.choice(list(described.units)))
        unit = described.units[key]
        values = [one for one in walk(unit) if one.declared is not None]
        changes = {}
        for k in rng.choice(len(values), size=int(rng.integers(2, 20)), replace=False):
            one = values[k].declared
            ends = [end for end in (one.above, one.least, one.below, one.most) if end is not None]
            changes[values[k].path] = str(rng.choice(ends))
        with suppress(RamsightError):
            machine_summary(described.model_copy(update={"units": {key: unit.replace(changes)}}), key)


@pytest.mark.parametrize(("text", "hint"), [
    ("name = foo", 'name = "foo"'),
    ("a = 1\nbore = 90 mm # of the rod's side", 'bore = "90 mm"'),
    ("x = 1.", None),
    ("a =", None),
    ('a = "b', None),
    ("k", None),
])  # fmt: skip
def test_a_text_without_quotation_marks_is_told_how_it_is_written(text, hint):
    with pytest.raises(TomlError) as refused:
        bounded_toml.loads(text)
    assert (hint is not None) == ("quotation marks" in str(refused.value))
    assert hint is None or str(refused.value).endswith(hint)


def test_the_hint_of_a_long_line_is_none():
    with pytest.raises(TomlError) as refused:
        bounded_toml.loads("a = " + "b c " * 200_000)
    assert len(str(refused.value)) < 100
