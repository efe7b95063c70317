"""A fleet as it is shown: assessed, in words, on a page, as a picture, a table and a Dataset."""

import json
import math
import re
import time
from html.parser import HTMLParser

import numpy as np
import pytest

import ramsight
from ramsight.histories.assessed import History, State, assessed
from ramsight.histories.history_page import fleet_page, machine_text
from ramsight.histories.history_store import Event, HistoryStore, Kept
from ramsight.histories.record import Learned, MachineKey, instant

from .command import as_command, at_once
from .history_bench import BEGUN, life, record

DAY = 86400.0


def warm(records):
    """The same over a year's temperatures, so that a thermometer's error does not matter."""
    from dataclasses import replace

    season = 0.04 + 0.02 * np.cos(2.0 * np.pi * np.linspace(0.0, 1.0, len(records)))
    return [replace(one, leak_per_kelvin=float(by)) for one, by in zip(records, season, strict=True)]


def history(records, events=(), serial="1", digest="d"):
    return History(Kept(MachineKey("mining-loader", "boom", serial), 1, "", digest, 1), records, events)


def test_a_worn_machine_is_dated_a_new_one_is_steady_and_a_spent_one_has_passed():
    worn, new, spent = assessed(
        [history(warm(life(80, rate=rate, seed=k)), serial=str(k)) for k, rate in ((1, 0.3), (2, 0.0), (3, 0.8))]
    )
    assert (worn.state, new.state, spent.state) == (State.DATED, State.STEADY, State.PASSED)
    assert re.match(r"2027-\d\d-\d\d \(90 %: 2027-", worn.date_text)
    assert worn.causes[0].cause.words == "the pumps wear"
    assert "passed already" in spent.date_text
    assert worn.sisters is spent.sisters
    assert not any(one.among.leaves for one in (worn, new, spent)), "three are too few"


def test_without_records_or_with_strange_ones_nothing_is_said():
    empty, strange = assessed([history([]), history([record(1, mistake="another machine's"), record(2, years=0.1)])])
    assert empty.state is State.UNKNOWN
    assert empty.date_text == "no log says anything of the leakage"
    assert empty.causes == ()
    assert "what has changed" not in machine_text(empty)
    assert len(strange.quantities["leak"].time) == 1
    assert strange.state is State.UNKNOWN
    assert strange.looks == ["1.csv: another machine's"]
    unknown = record(3, quantities={"leak": Learned(math.nan, 0.1)})
    cold = record(4, leak_per_kelvin=math.nan)
    (nothing,) = assessed([history([unknown, cold])])
    assert "leak" not in nothing.quantities


def test_a_repair_is_a_step_at_the_first_record_after_it():
    records = warm(life(60, rate=0.0, seed=2))
    events = [Event(records[30].begun - DAY, "repair"), Event(BEGUN - DAY, "other"), Event(BEGUN + 900 * DAY, "other")]
    (found,) = assessed([history(records, events)])
    assert [(step.record, step.is_declared) for step in found.quantities["leak"].steps] == [(30, True)]


def test_a_thermometer_that_may_be_off_is_in_the_leakage_alone():
    (found,) = assessed([history(life(40, rate=0.0))])
    leak, compliance = found.quantities["leak"], found.quantities["compliance"]
    assert leak.now_std > 0.1 > 0.05 > compliance.now_std
    assert leak.change_std < 0.05, "it does not change"


def test_a_leak_that_came_with_the_oil_change_is_the_oils():
    before, after = life(40, rate=0.0, seed=1, span=0.5), life(40, rate=0.0, seed=2, span=0.5)
    from dataclasses import replace

    thin = {"leak": Learned(1.35, 0.03, 1.0, 0.16), "exponent": Learned(0.0, 0.01, 0.0, 0.03)}
    after = [replace(one, begun=one.begun + 183 * DAY, quantities=thin) for one in after]
    change = Event(after[0].begun - 3600.0, "oil change")
    (with_it,) = assessed([history(before + after, [change])])
    (without,) = assessed([history(before + after, [Event(change.at, "repair")])])
    assert with_it.causes[0].cause.words == "the oil is thinner"
    assert without.causes[0].cause.words == "the pumps wear"


def test_only_machines_of_one_description_are_sisters():
    found = assessed([history(life(5, seed=k), serial=str(k), digest="da"[k > 1]) for k in range(3)])
    assert found[0].sisters is found[1].sisters is not None
    assert found[2].sisters is None


class Page(HTMLParser):
    """Open tags, links and rows of a page."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.ids, self.bad = [], set(), set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        known = dict(attrs)
        self.ids |= {known["id"]} if "id" in known else set()
        self.links |= {known["href"]} if "href" in known else set()
        self.bad += [one for name in ("src", "href") if (one := known.get(name, "#")) and not one.startswith("#")]
        if tag not in {"meta", "br"}:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_needs_nothing_else_and_escapes_what_it_shows():
    evil = "<script>alert(1)</script>"
    records = [*warm(life(30, seed=1)), record(99, years=0.5, file=evil, mistake=evil)]
    found = assessed([history(records, [Event(BEGUN + DAY, "repair", evil)], serial=evil), history([], serial="empty")])
    text = fleet_page(found, f"fleet {evil}")
    page = Page(text)
    assert page.open == []
    assert page.bad == []
    assert page.links == {f"#{one}" for one in page.ids} == {"#m0", "#m1"}
    assert evil not in text
    assert "&lt;script&gt;alert" in text
    assert not re.search(r"https?://", text)
    assert "nan" not in text


def test_what_is_due_first_stands_first_and_who_leaves_is_named():
    rates = [0.0, 0.01, 0.3, 0.0, 0.02, 0.01]
    fleet = [history(warm(life(60, rate=rate, seed=k)), serial=f"no {k}") for k, rate in enumerate(rates)]
    worse = [record(f"w{k}", years=k / 60, leak=2.2, std=0.03) for k in range(60)]
    text = fleet_page(assessed([*fleet, history(warm(worse), serial="no 9")]), "fleet")
    order = re.findall(r'<a href="#m\d">mining-loader, boom, (no \d)', text)
    assert order[:2] == ["no 9", "no 2"]
    assert "These leave the others: mining-loader, boom, no 9." in text
    assert text.count("leaves the others</span>") == 1


@pytest.mark.slow
def test_a_fleet_of_a_hundred_is_shown_in_seconds():
    fleet = [history(life(1000, rate=0.3 * (k % 3 == 0), seed=k), serial=str(k)) for k in range(100)]
    begun = time.perf_counter()
    text = fleet_page(assessed(fleet), "fleet")
    assert time.perf_counter() - begun < 20.0, "6 s alone"
    assert len(text.encode()) < 3e6


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.db"
    with HistoryStore(path, makes=True) as made:
        for serial, rate in (("1", 0.35), ("2", 0.0)):
            key = MachineKey("mining-loader", "boom", serial)
            place = made.described(key, "d", "")
            for one in warm(life(30, rate=rate, seed=int(serial))):
                made.add(place, one)
    ramsight.history_event(path, "mining-loader", "oil change", "2026-02-01", unit="boom", serial="1", note="HLP 46")
    return path


def test_a_dataset_has_all_of_it(store):
    found = ramsight.history(store, "mining-loader", serial="1", limits={"leak": 1.4})
    assert found.sizes == {"time": 30, "quantity": 5}
    assert found["value"].attrs["units"] == "1"
    assert found["worked"].attrs["units"] == "s"
    leak = found.sel(quantity="leak")
    assert float(leak["limit"]) == 1.4
    assert leak["limit_low"] < leak["limit_date"] < leak["limit_high"]
    assert str(found["time"].values[0]) == "2026-01-01T00:00:00.000000000"
    assert float(leak["trend"][-1]) == pytest.approx(1.35, abs=0.06)
    assert float(np.abs(leak["value"] - leak["trend"]).max()) < 5.0 * float(leak["value_std"].max())
    nothing = found.sel(quantity="relief")
    assert nothing["value"].isnull().all()
    assert str(nothing["limit_date"].values) == "NaT"
    assert (found.attrs["state"], found.attrs["serial"]) == ("wears", "1")
    with pytest.raises(ramsight.UnknownNameError, match="mining-loader, boom, 2"):
        ramsight.history(store, "mining-loader")
    with pytest.raises(ramsight.UnknownNameError, match="unknown machine 'press'"):
        ramsight.history(store, "press")


def test_the_command_shows_plots_reports_and_exports(store, tmp_path):
    done = as_command("history", "show", "mining-loader", "--serial", "1", "--store", store)
    assert done.returncode == 0, done.stderr
    assert "mining-loader, boom, 1: wears; 30 records" in done.stdout
    assert "2026-02-01: oil change HLP 46" in done.stdout
    assert "%: the pumps wear (measure the case drain" in done.stdout
    both = at_once("history", "show", "--store", store)
    assert [line for line in both.stdout.splitlines() if "steady" in line]
    said = json.loads(at_once("history", "show", "--store", store, "--json").stdout)
    assert [one["state"] for one in said["machines"]] == ["wears", "steady"]
    assert said["machines"][0]["quantities"]["leak"]["limit_date"] > instant("2027-01-01")
    for words, file in (
        (("report",), "fleet.html"), (("plot", "mining-loader", "--serial", "1"), "one.svg"), (("export",), "all.csv"),
    ):  # fmt: skip
        done = at_once("history", *words, "--out", tmp_path / file, "--store", store)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        assert (tmp_path / file).stat().st_size > 1000
    rows = (tmp_path / "all.csv").read_text().splitlines()
    assert len(rows) == 61
    assert rows[0].startswith("machine,unit,serial,file,begun_s,duration_s,worked_s,oil_low_k")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("show", "press"), "unknown machine 'press'"),
        (("show", "--limit", "leak"), "--limit = 'leak': is no limit (allowed: leak=1.5)"),
        (("show", "--limit", "rust=1"), "--limit = 'rust': is not followed"),
        (("plot", "mining-loader", "--out", "a.png"), "known: mining-loader, boom, 1; mining-loader, boom, 2"),
        (("report", "--out", "a.txt"), "unknown suffix"),
        (("export", "--out", "a.nc"), "unknown suffix"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(store, words, says):
    done = at_once("history", *words, "--store", store)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert says.replace("; ", ", ") in done.stderr.replace("; ", ", ")


def test_a_machine_in_words_lists_steps_and_no_more_than_some_logs():
    records = [record(k, years=k / 40, leak=1.0 if k < 20 else 1.25, std=0.02) for k in range(40)]
    records += [record(f"odd {k}", years=1.01, mistake="another") for k in range(14)]
    (found,) = assessed([history(records)])
    text = machine_text(found)
    assert "leak steps by +0.2" in text
    assert "and 4 more" in text
