"""What verbs share: a unit that may be left out, colours, sections of the help, tables that fit a narrow terminal."""

import os
import re
import subprocess
import sys
from typing import Annotated

import pytest
import typer
from rich.console import Console

from ramsight import machine
from ramsight.api.abilities import abilities
from ramsight.cli.common import coloured, named_unit
from ramsight.cli.verbs import GROUPS, SECTIONS, Verb, app
from ramsight.errors import DescriptionError
from ramsight.machine.tables import catalogue_list, rows_of
from ramsight.plant.machine_tables import machine_summary

from .command import at_once

NARROW = 60
RED, YELLOW = "\x1b[31m", "\x1b[33m"


def test_the_only_unit_need_not_be_named(tmp_path):
    assert named_unit("forklift-mast", None) == "lift"
    assert named_unit("mining-loader", "bucket") == "bucket"
    with pytest.raises(DescriptionError, match=r"unit.*boom, bucket"):
        named_unit("mining-loader", None)
    done = at_once("simulate", "press", "--load", "100 kN", "--hold", "0.1 s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    refused = at_once("simulate", "mining-loader", "--load", "100 kN", cwd=tmp_path)
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1)
    assert "--unit" in refused.stderr


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            DescriptionError("is too much", key="start_std", value="9 m", allowed="1 m"),
            "--start-std = '9 m': is too much",
        ),
        (DescriptionError("is no map", key="channel_map"), "--map: is no map"),
        (DescriptionError("is none", key="machine", value=3), "machine = 3: is none"),
        (DescriptionError("is too much", file="a.toml", key="start_std"), "a.toml: start_std: is too much"),
        (DescriptionError("is missing", key="units.boom"), "units.boom: is missing"),
    ],
)
def test_an_error_names_the_option_that_the_function_calls_an_argument(error, said):
    def verb(machine: str, start_std: str = "", channel_map: Annotated[str, typer.Option("--map")] = "") -> None:
        error.others = (DescriptionError("more"),)
        raise error

    app = typer.Typer()
    app.command(cls=Verb)(verb)
    with pytest.raises(DescriptionError) as raised:
        app(["press"], standalone_mode=False)
    assert str(raised.value).startswith(said)
    assert len(raised.value.others) == 1


def test_every_verb_stands_in_one_section_of_the_help():
    shown = at_once("--help").stdout
    verbs = [verb for verbs in SECTIONS.values() for verb in verbs]
    assert len(verbs) == len(set(verbs))
    assert {*verbs, *GROUPS} == set(typer.main.get_command(app).commands)
    for title in SECTIONS:
        assert f"\n{title}:\n" in shown
    for verb in (*verbs, *GROUPS):
        assert len(re.findall(rf"^  {verb}  ", shown, flags=re.MULTILINE)) == 1


def test_no_color_switches_colours_off(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert coloured("error", "red").startswith(RED)
    monkeypatch.setenv("NO_COLOR", "1")
    assert coloured("error", "red") == "error"
    assert at_once("check", "nothing-like-that").stderr.startswith("error: "), "a pipe has none"


@pytest.mark.posix
@pytest.mark.parametrize(("environment", "begins"), [({}, f"{RED}error"), ({"NO_COLOR": "1"}, "error: ")])
def test_a_terminal_sees_errors_in_red(environment, begins):
    import pty

    outer, inner = pty.openpty()
    known = {name: value for name, value in os.environ.items() if name != "NO_COLOR"} | environment
    command = [sys.executable, "-m", "ramsight.cli", "check", "nothing-like-that"]
    subprocess.run(command, stderr=inner, stdout=inner, stdin=subprocess.DEVNULL, env=known, check=False, timeout=60)
    os.close(inner)
    assert os.read(outer, 10_000).decode().startswith(begins)
    os.close(outer)


def printed(what):
    console = Console(width=NARROW, highlight=False, force_terminal=False)
    with console.capture() as said:
        console.print(what)
    return said.get()


NAMES = [entry.name for entry in machine.catalogue.entries() if entry.kind == "machine"]


@pytest.mark.parametrize("name", NAMES)
def test_a_check_fits_sixty_columns_and_loses_no_number(name):
    shown = printed(machine_summary(machine.load_machine(name)))
    assert max(map(len, shown.splitlines())) <= NARROW
    assert "…" not in shown
    for unit in machine.load_machine(name).units:
        lines = printed(rows_of((one.what, "yes", one.how) for one in abilities(name, unit=unit))).splitlines()
        assert max(map(len, lines)) <= NARROW
        assert "…" not in "".join(lines)


def test_the_catalogue_fits_sixty_columns_with_every_name_whole():
    shown = printed(catalogue_list())
    assert max(map(len, shown.splitlines())) <= NARROW
    for entry in machine.catalogue.entries():
        assert re.search(rf"^(  {re.escape(entry.name)} |{entry.kind})", shown, flags=re.MULTILINE), entry.name
