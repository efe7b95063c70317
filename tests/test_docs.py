"""What is written down is true: examples run, and the figures are those of the benchmark."""

import ast
import doctest
import importlib
import json
import pkgutil
import re
from pathlib import Path

import pytest

import ramsight
from ramsight.constant import constants_of
from ramsight.sensor import redundancy
from ramsight.sensor.report import detectors
from ramsight.sensor.report.detectors import DETECTORS
from ramsight.sensor.status import Status

ROOT = Path(__file__).parent.parent
BELOW = sorted(m.name for m in pkgutil.walk_packages(ramsight.__path__, "ramsight.") if not m.name.endswith("__main__"))
BESIDE = [
    f"{name}.{module.name}" for name in ("film", "reproduction") for module in pkgutil.iter_modules([str(ROOT / name)])
]
MODULES = ["ramsight", *BELOW, *(name for name in BESIDE if not name.endswith("__main__"))]
LONG = (
    "film.", "reproduction.", "ramsight.control.", "ramsight.closed_loop.", "ramsight.api.", "ramsight.deploy.",
    "ramsight.calibration.", "ramsight.study.",
)  # fmt: skip
"""Rooms whose examples make sensors and let machines work."""


def marked(name):
    return pytest.param(name, marks=[pytest.mark.slow] if name.startswith(LONG) else [])


@pytest.mark.parametrize("name", [marked(name) for name in MODULES])
def test_examples_in_docstrings_run(name):
    outcome = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert outcome.failed == 0


@pytest.mark.slow
def test_the_page_of_python_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    monkeypatch.chdir(tmp_path)
    plot, track, weighs, many, sweep = re.findall(
        r"```python\n(.*?)```", (ROOT / "docs" / "how-to" / "python.md").read_text(), flags=re.DOTALL
    )
    assert len([line for line in plot.splitlines() if line]) == 3
    assert len([line for line in many.splitlines() if line]) <= 10
    exec(plot, {})
    assert (tmp_path / "run.png").stat().st_size > 10_000
    names = {}
    exec(track, names)
    assert names["now"].position == pytest.approx(0.1)
    assert names["track"].attrs["error_largest"] < 1e-3
    assert names["recorded"].sizes["time"] > 1000
    assert names["recorded"].attrs["error_largest"] < 1e-3
    exec(weighs, weighing := {})
    assert " kg, rated load: within" in capsys.readouterr().out
    assert [one.is_good for one in weighing["live"].weighings] == [True]
    assert many.count("size=1000") == 2
    exec(many.replace("size=1000", "size=40"), names)  # a thousand run in examples/monte_carlo.py
    assert names["runs"].sizes == {"duty": 40}
    assert (names["runs"]["outcome"] == "done").all()
    assert len([line for line in sweep.splitlines() if line]) <= 15
    exec(sweep.replace("size=500", "size=20"), names)
    assert names["sweep"].sizes == {"machine": 20, "duty": 1}
    assert (tmp_path / "sweep.png").stat().st_size > 10_000


def verbs_and_named(page):
    from ramsight.cli.verbs import GROUPS, SECTIONS

    verbs = {verb for verbs in SECTIONS.values() for verb in verbs}
    return verbs | {*GROUPS}, set(
        re.findall(r"(?:^|`)ramsight (\w[\w-]*)", (ROOT / page).read_text(), flags=re.MULTILINE)
    )


def test_the_readme_is_short_and_names_verbs_that_exist():
    verbs, named = verbs_and_named("README.md")
    assert {"demo", "track"} <= named <= verbs
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 126
    blocks = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL)
    assert sum(len(block.splitlines()) for block in blocks) <= 5
    pictures = re.findall(r'src="(.*?)"', text)
    assert len(pictures) == 2, "what it knows, and how machines change"
    assert all((ROOT / one).is_file() for one in pictures)


def test_the_page_of_commands_has_every_verb():
    verbs, named = verbs_and_named("docs/reference/commands.md")
    assert named == verbs


@pytest.mark.parametrize("name", ["README.md", "docs/index.md"])
def test_what_to_expect_is_what_sheets_and_studies_found(name, script):
    expected = script("expected")
    page = ROOT / name
    assert page in expected.PAGES
    for block, rows in expected.tables(page).items():
        assert marked_block(block, rows) in page.read_text(), block


def test_the_first_page_answers_ten_questions_each_with_a_page():
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^## Ten questions\n\n(.*?)\n\n", text, flags=re.MULTILINE | re.DOTALL)
    rows = re.findall(r"^\| (.+?\?) \| (.+?) \| (.*\]\(.+?\.md.*) \|$", table, flags=re.MULTILINE)
    subjects = ("cost", "hardware", "accurate", "trust", "fails", "uses", "licence", "helps", "Windows", "PLC")
    assert len(rows) == len(subjects)
    for subject, (question, answer, _) in zip(subjects, rows, strict=True):
        assert subject in question
        assert len(answer.split()) >= 5, question


def text_of(*pages):
    return "".join((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8") for page in pages)


def found_in(result):
    return json.loads((ROOT / "results" / f"{result}.json").read_text(encoding="utf-8"))


def marked_block(name, rows):
    return f"<!-- {name} -->\n\n" + "\n".join(rows) + f"\n\n<!-- end of {name} -->"


def test_every_table_that_a_script_writes_is_that_of_study_and_code(script):
    pages, limits = script("pages"), script("limits_page", "benchmarks")
    tables = pages.all_tables(found_in("study"))
    assert {"recorded", "faults", "structure", "commissioned", "tuned_sensor", "sensor_thresholds"} <= tables.keys()
    for name, rows in tables.items():
        assert marked_block(name, rows) in pages.page_of(name).read_text(encoding="utf-8"), name
    for name, rows in limits.tables(found_in("bench")).items():
        assert marked_block(name, rows) in limits.PAGE.read_text(encoding="utf-8"), name


QUOTED = {
    "outputs": ("reference/log-formats", lambda script: script("sensor_outputs").rows()),
    "keys": ("reference/description-keys", lambda script: script("description_keys").rows()),
    "rig": ("validation", lambda script: script("eha_rig_page").table(script("eha_rig_page").read())),
    "studio": ("how-to/studio", lambda script: script("studio", "benchmarks").table(found_in("studio"))),
    "real_leak": ("how-to/history", lambda script: script("real_leak").table(found_in("real_leak"))),
    "history": ("how-to/history", lambda script: script("history_study").table(found_in("history"))),
    "fuzzing": ("reference/fuzzing", lambda script: script("page", "fuzz").table(found_in("fuzz"))),
    "limits": ("reference/fuzzing", lambda script: script("page", "fuzz").measured(found_in("fuzz"))),
}
"""Tables that have no marks: the page, and what makes the rows."""


@pytest.mark.parametrize("name", QUOTED)
def test_a_page_has_the_rows_of_code_and_results(name, script):
    page, rows = QUOTED[name]
    assert "\n".join(rows(script)) in text_of(page)


def test_the_pages_quote_the_benchmark():
    found = found_in("bench")
    factor, error = found["loader_realtime_factor"], f"{found['loader_error_m']:.1e}".replace("e-0", "e-")
    quoted = [
        f"**{found['single_ms']:.2f}**", f"| {found['single_c_ms']:.2f} |",
        f"| {found['casadi_cvodes_vs_single']:.1f} |", f"| {found['scipy_lsoda_vs_single']:.0f} |",
        f"**{found['batch_cycles_per_s']:.0f}**", f"| {found['batch_c_cycles_per_s']:.0f} |",
        f"| {found['cold_start_s']:.1f} |", f"| {found['warm_start_s']:.2f} |", f"| {found['help_s']:.2f} |",
        f"| {found['track_start_s']:.1f} |", f"| {factor:.0f} |", f"| {error} |",
    ]  # fmt: skip
    quoted += [
        f"| {found[f'{name}_first_processor_s']:.1f} | {found[f'{name}_processor_s']:.2f} |"
        for name in ("track", "simulate", "help", "export_c", "export_fmu")
    ]
    assert [figure for figure in quoted if figure not in text_of("reference/performance")] == []
    assert max(found[key] for key in ("single_error_m", "batch_error_m", "c_error_m")) < 1e-6
    for figure in (
        f"{found['kalman_replay_samples_per_s'] / 1e6:.1f} million samples a second",
        f"{found['kalman_step_us']:.1f} µs",
    ):
        assert figure in text_of("reference/accuracy")


def test_outputs_and_keys_are_of_each_kind(script):
    assert {row.split(" | ")[-1] for row in script("sensor_outputs").rows()[2:]} == {
        "always |",
        "with further signals |",
    }
    page = text_of("reference/description-keys")
    for key in ("`bore`", "`leak_walk`", "`pilot_ratio`", "`retracted_length`", "`visit_every`", "`torque_gain`"):
        assert f"| {key} |" in page


def test_every_number_of_sensor_and_control_has_its_unit_and_its_reason(script):
    for table in script("pages").THRESHOLDS.values():
        assert len(constants_of(table)) > 8
        for constant, value in constants_of(table).items():
            assert "|" not in value.unit + value.reason, constant
            assert value.unit, constant
            assert len(value.reason) > 10 or "as " in value.reason, constant


def test_studies_found_what_may_be_relied_on(script):
    """Bounds of figures that pages quote."""
    found = found_in("study")
    both = found["faults"]["+ counter and DC power"]
    wrong = [row for row in both["rows"] if row["input"] in ("motor_speed", "motor_torque")]
    assert max(row["harm_unseen"] for row in wrong) <= 0.01
    assert both["contradictions_without_a_fault"] == 0
    assert all(row["over"] == row["judged"] for row in found["after_faults"]["+ counter and DC power"])
    assert [row["name"] for row in found["effects"]] == [effect.name for effect in script("effects").EFFECTS]
    assert all(row["standstill"] <= 0.3 for row in found["unit_control"].values())
    margins = [row for drives in found["loop_response"].values() for row in drives.values()]
    assert min(row["phase_margin"] for row in margins) > 60.0
    assert min(row["gain_margin"] or 10.0 for row in margins) > 3.0
    drives = found["drive_control"]
    for label in drives["moves"]:
        of = [drives[key][label] for key in ("worked", "watched", "silent") if label in drives[key]]
        assert sum(one["hours"] for one in of) >= 10.0, label
        assert sum(one["stops"] for one in of) == 0, label


MINUTES = {"24 h without a restart": 1, "log of 10^8 rows": 1, "restart on a busy bus": 30, "OPC UA flooded": 10}
KNOWN = {"soak": 5}
"""Cases of sections whose case takes minutes; and cases that are known to be wrong, which SECURITY.md counts."""


def test_the_fuzzing_found_what_security_counts_and_nothing_else(script):
    found = found_in("fuzz")
    assert "\n".join(script("page", "fuzz").limits(found)) in (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    for name, section in found["sections"].items():
        assert (name, section["crashed"], section["hung"]) == (name, 0, 0)
        assert (name, section["silently_wrong"]) == (name, KNOWN.get(name, 0))
        assert section["tried"] >= MINUTES.get(name, 100)


@pytest.mark.slow
def test_the_page_of_the_control_runs():
    first, second = re.findall(r"```python\n(.*?)```", text_of("how-to/control"), flags=re.DOTALL)
    names = {}
    for block, position in ((first, 0.05), (second, 0.3)):
        exec(block, names)
        assert names["loop"].now.position["ram"] == pytest.approx(position, abs=4e-3)


def test_the_page_of_studies_quotes_its_sheets_and_the_benchmark(script):
    sheets = script("datasheets")
    page = text_of("reference/data-sheets", "explanation/data-sheet-method")
    for name, rows in sheets.tables().items():
        assert "\n".join(rows) in page, name
    for name, sheet in sheets.found().items():
        assert all(after is None or after["inside"] for one in sheet["recorded"] for after in one["after"]), name
        text = (ROOT / "docs" / "sheets" / f"{name}.html").read_text()
        assert f"{sheet['machines']} machines drawn from their tolerances" in text
        assert "http" not in text.replace("http://www.w3.org", "")
    bench = found_in("bench")
    parts = bench["study_ms_of_a_machine"]
    for quoted in (
        f"{sum(parts.values()):.0f} ms", f"{parts['simulated']:.0f} ms",
        f"{parts['tracked'] + parts['tracked_untold']:.0f} ms",
        f"{bench['study_machines_per_s']:.1f} machines a second",
        f"{bench['study_dask_machines_per_s']:.1f} on Dask", f"{bench['study_dask_scaling']:.2f} times",
        f"{bench['study_peak_mib']:.0f} MiB", f"{bench['study_store_bytes_per_machine'] / 1000:.1f} kB",
    ):  # fmt: skip
        assert quoted in " ".join(page.split()), quoted


def test_every_threshold_of_a_detector_is_a_number_of_the_table():
    """Whoever changes one changes what the page says."""
    tree = ast.parse(Path(detectors.__file__).read_text(encoding="utf-8"))
    (rows,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "DETECTORS"
    )
    texts = [part for row in rows.elts for part in (*row.args[3:], *row.keywords)]
    found = [node.value for text in texts for node in ast.walk(text) if isinstance(node, ast.Constant)]
    assert [text for text in found if isinstance(text, str) and re.search(r"\d", text)] == []


def test_what_structure_cannot_show_no_detector_claims():
    """Signals of a detector that are not in every drive are among those with which its fault is visible at all."""
    plain = redundancy.detectable(())
    assert all(value is None for value in plain.values())
    named = redundancy.detectable(("counter", "DC power"))
    assert named["speed"] == named["counter"] == ()
    assert named["torque"] == ("DC power",)
    claims = {Status.SPEED_CONTRADICTED: "speed", Status.TORQUE_CONTRADICTED: "torque", Status.SPEED_WRONG: "speed"}
    for one in DETECTORS:
        if one.status in claims:
            assert redundancy.detectable(one.needs)[claims[one.status]] is not None, one.status
        if one.status is Status.SPEED_WRONG:
            assert redundancy.detectable(one.needs)["speed"] == ()


IN_FOLDERS = (page for page in (ROOT / "docs").rglob("*.md") if "gallery" not in page.parts)
PAGES = sorted(page.relative_to(ROOT / "docs").as_posix() for page in IN_FOLDERS)
# What speaks of the project as it is today, and not of former versions.
TODAYS = [*(f"docs/{page}" for page in PAGES), "README.md", "CONTRIBUTING.md"]


LISTS = [page for page in PAGES if page.endswith("index.md")]


def listed(above, what):
    """The pages of an index page's contents, or of its lines with a description."""
    text = (ROOT / "docs" / above).read_text()
    entries = [line for block in re.findall(r"```{toctree}\n(.*?)```", text, flags=re.DOTALL) for line in block.split()]
    described = re.findall(r"^- \[.+\]\(([\w./-]+)\.md\): .+", text, flags=re.MULTILINE)
    folder = (ROOT / "docs" / above).parent
    names = {"contents": entries, "described": described}[what]
    return [(folder / f"{name}.md").resolve() for name in names if not name.startswith(":")]


@pytest.mark.parametrize("what", ["contents", "described"])
def test_every_page_is_listed_once_by_an_index_page(what):
    found = [one for above in LISTS for one in listed(above, what)]
    times = {page: found.count((ROOT / "docs" / page).resolve()) for page in PAGES if page != "index.md"}
    assert {page: count for page, count in times.items() if count != 1} == {}


def test_the_site_takes_nothing_from_another_host():
    settings = (ROOT / "docs" / "conf.py").read_text()
    assert "//" not in settings
    assert "intersphinx" not in settings


def test_relative_links_lead_to_files_of_the_repository():
    named = []
    for page in (*TODAYS, "CHANGELOG.md"):
        text = re.sub(r"```.*?```", "", (ROOT / page).read_text(), flags=re.DOTALL)
        named += [(page, link) for link in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text) if "://" not in link]
    assert [(page, link) for page, link in named if not ((ROOT / page).parent / link).exists()] == []
    assert len(named) > 300


def test_files_that_a_page_names_are_there():
    name = re.compile(r"`((?:evaluation|benchmarks|tests|src|fuzz|examples|docs)/[\w./-]+)`")
    named = [(page, one) for page in TODAYS for one in name.findall((ROOT / page).read_text())]
    assert [(page, one) for page, one in named if not (ROOT / one).exists()] == []
    assert len(named) > 50


def test_the_map_of_changes_names_files_targets_and_tests_that_are_there():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    named = [
        one for one in re.findall(r"`([\w./*]+\.(?:py|toml)|[\w/]+/)`", text) if one != "dist/"
    ]  # made when packed
    assert len(named) > 50
    folders = (ROOT, ROOT / "src" / "ramsight", ROOT / "tests")
    assert [one for one in named if not any(list(folder.glob(one)) for folder in folders)] == []
    made = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"`make (\w+)", text)) <= made
    listed = re.findall(r"^#.* make (\w+)", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    assert made - set(listed) <= {"help"}, "make help does not list it"


def test_what_runs_before_a_commit_is_the_lint():
    """The hooks are the Makefile's lines in their order, each on everything, with tools that are there already."""
    yaml = pytest.importorskip("yaml")
    (recipe,) = re.findall(r"^lint:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    (local,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert local["repo"] == "local"
    entries = [line.strip().replace("$(BIN)", ".venv/bin") for line in recipe.splitlines()]
    assert [hook["entry"] for hook in local["hooks"]] == entries
    for hook in local["hooks"]:
        assert (hook["language"], hook["pass_filenames"], hook["always_run"]) == ("system", False, True)


def test_every_assumption_that_the_logs_know_can_be_varied(script):
    recorded = script("recorded")
    names = [name for name, _ in recorded.variants()]
    assert len(names) == len(set(names)) > 50
    assert {"machine.leaks_otherwise ×", "thermometer.lag ÷"} <= set(names)
    assert not any(name.startswith(("motor_temperature", "inertia")) for name in names)
