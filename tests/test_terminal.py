"""No text of a file commands a terminal: every verb, with names that somebody else chose."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import ramsight
from ramsight.cli.verbs import app
from ramsight.errors import one_line, printable
from ramsight.machine import load_machine, template
from ramsight.tracking.figures import verbatim
from tests.command import at_once

TITLE = "\x1b]0;owned\x07"
"""Sets the title of a terminal; what tests capture is stripped of colours, and not of this."""
FALSE = f"{TITLE}\nerror: all is well"
"""And a line of its own, which nobody said."""
SAMPLES = "\n".join(f"{0.02 * k:.2f},0,0,40" for k in range(9))


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """Files with such names, columns and keys; titles and units of descriptions with what TOML lets through."""
    folder = tmp_path_factory.mktemp("hostile")
    files = {
        "machine": (f"m{FALSE}.toml", template().replace("[units.", "[units.x\u202e", 1)),
        "log": (f"l{FALSE}.csv", "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n" + SAMPLES),
        "columns": (f"c{FALSE}.csv", f'a{TITLE},"b{FALSE}",c,d\n' + SAMPLES),
        "map": (f"k{FALSE}.toml", '[time]\nchannel = "a\\nb"\n'),
        "key": (f"y{FALSE}.toml", template() + '\n"a\u202eb\\nc" = 1\n'),
        "sheet": (f"s{FALSE}.csv", FALSE),
    }
    found = {}
    for name, (file, text) in files.items():
        found[name] = folder / file
        found[name].write_text(text, encoding="utf-8")
    return found | {"none": folder / f"none{FALSE}.toml", "folder": folder / f"d{FALSE}"}


VERBS = {
    "new": "{none} --like {none}",
    "check": "{machine}; {none}; {key}; mining-loader --map {map}",
    "draw": "{machine} --out {folder}; {none} --out {folder}",
    "simulate": "{machine} --log {folder}; mining-loader --unit {log}",
    "datasheet": "{machine} --out {folder}; mining-loader --unit boom --log {columns} --out {none}",
    "track": "mining-loader {columns} --unit boom; {machine} {log} --map {map}; mining-loader {log} --unit {log}; "
    "mining-loader {log} {log} --unit boom --start 0.1 --at {log}",
    "compare": "mining-loader {columns} {log} --unit boom",
    "weigh": "mining-loader {columns} --at bucket={log}; {machine} {log}; mining-loader {log} --known {log}={log}",
    "leak-test": "mining-loader {columns} --unit boom; {machine} {log}",
    "identify": "mining-loader {columns} --unit boom --truth {log}; {machine} {log}",
    "calibrate": "{machine} --out {folder}",
    "commission": "{machine} {log}; mining-loader {columns} --unit boom",
    "encoder": "{machine} --channel {log}; mining-loader --unit boom --interface {log} --channel {log}",
    "fmeda": "{sheet}; {none}",
    "demo": "--out {folder}",
    "studio": "{none}; {key}",
    "catalog": "{log}",
    "catalog show": "{none}",
    "catalog check": "",
    "logs inspect": "{columns}; {log} --map {map}; {log} --dbc {columns}; {none}",
    "logs shared": "{columns} {log}",
    "logs replay": "{columns} --channel {log} --rated-torque 80Nm",
    "history add": "{machine} {log} --store {none}; mining-loader {columns} --unit boom --store {none}",
    "history event": "{log} repair {log} --store {log} --unit boom; boom {log} 2026-03-01 --store {none} --unit {log}",
    "history show": "{log} --store {log}; {log} --store {none}",
    "history plot": "{log} --store {log} --out {folder}",
    "history report": "{log} --store {log} --out {folder}",
    "history export": "--store {columns} --out {folder}",
    "export c": "{machine} --out {folder}",
    "export fmu": "{machine} --out {folder}",
    "export ssp": "{machine} --out {folder}",
    "export parameters": "{machine} --out {folder}",
    "export wasm": "{machine} --out {folder}",
    "export page": "--out {folder}",
    "export fmeda": "{machine} --out {folder}",
}
"""Command lines of each verb, all of which have to end by themselves."""


def verbs():
    """Names of all verbs, those of groups with the group's before."""
    for name, one in typer.main.get_command(app).commands.items():
        yield name
        yield from (f"{name} {inner}" for inner in getattr(one, "commands", {}))


def test_every_verb_is_tried():
    assert {*verbs()} - {"logs", "export", "history"} == {*VERBS}


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_says_nothing_that_commands_a_terminal(verb, hostile, monkeypatch):
    monkeypatch.setenv("RAMSIGHT_CATALOG", str(hostile["folder"].parent))
    monkeypatch.setenv("NO_COLOR", "1")
    for words in (*VERBS[verb].split(";"), "{log} {log} {log} {log} {log}", "--unknown{log}"):
        passed = [word.format_map(hostile) for word in words.split()]
        done = at_once(*verb.split(), *passed)
        said = done.stdout + done.stderr
        assert done.returncode in (0, 1, 2)
        assert said, words
        assert "Traceback" not in said
        assert not [c for c in said if not c.isprintable() and c != "\n"], said
        assert not re.search(r"^error: all is well", said, re.MULTILINE), said


def test_a_verb_that_works_names_its_files_escaped(hostile, monkeypatch, tmp_path):
    monkeypatch.setenv("NO_COLOR", "1")
    out = tmp_path / f"t{FALSE}.csv"
    done = at_once("track", "mining-loader", hostile["log"], "--unit", "boom", "--start", "100 mm", "--out", out)
    assert done.returncode == 0
    assert out.exists()
    assert r"\x1b]0;owned\x07\nerror: all is well.csv: written" in done.stdout
    assert not re.search(r"[\x00-\x09\x0b-\x1f]|^error", done.stdout + done.stderr, re.MULTILINE)


def test_what_is_written_of_a_name_can_be_read_again(tmp_path):
    for name in (FALSE, os.fsdecode(b"\xff")):
        file = tmp_path / f"n{name}.toml"
        for words in (["new", file], ["new", file, "--force", "--minimal"]):
            assert at_once(*words).returncode == 0
            assert load_machine(file).name.startswith("n\\")
    assert "\x1b" not in verbatim(FALSE), "in the title of a picture"


def test_what_is_printed_was_escaped():
    source = Path(ramsight.__file__).parent
    for file in source.rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if re.search(r"typer\.s?echo|print\(", text) else ():
            if isinstance(node, ast.Call) and ast.unparse(node.func) in ("typer.echo", "typer.secho", "print"):
                said = ast.unparse(node.args[0])
                assert any(one in said for one in ("one_line(", "printable(", "line")), (file, said)


@pytest.mark.parametrize("text", ["\x00", "\x1b", "\x7f", "\x9b", "\u202e", "\u2028", "\udc80", "\r", "\t"])
def test_every_character_that_shows_nothing_is_escaped(text):
    assert one_line(f"a{text}b").isprintable()
    assert printable(f"a\n{text}").partition("\n")[2].isprintable()


def test_a_terminal_of_ascii_alone_is_enough(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "ramsight.cli", "check", "press"],
        capture_output=True, check=False, cwd=tmp_path,
        env=os.environ | {"PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"40 \xb0C" in done.stdout
