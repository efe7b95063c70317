"""A release says one version everywhere, is cited as it is, and is checked by the same script on every host."""

import re
import tomllib
from datetime import date
from pathlib import Path

import pytest

import ramsight

ROOT = Path(__file__).parent.parent
KEYS = {"cff-version", "message", "title", "type", "authors", "version", "date-released", "license", "references"}
TOOLS = {"all", "dev", "docs", "platforms"}
"""Extras for whoever changes ramsight, with a compiler for machines that tests do not have, or of other extras."""


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def loaded(name):
    return pytest.importorskip("yaml").safe_load(text_of(name))


@pytest.fixture(scope="module")
def project():
    return tomllib.loads(text_of("pyproject.toml"))


@pytest.fixture(scope="module")
def citation():
    return loaded("CITATION.cff")


@pytest.fixture(scope="module")
def releases():
    """Headings of versions in the changelog, newest first: name and day."""
    return re.findall(r"^## \[(.+?)\](?: - (\S+))?$", text_of("CHANGELOG.md"), flags=re.MULTILINE)


def test_package_citation_and_changelog_have_one_version(project, citation, releases):
    assert project["project"]["dynamic"] == ["version"]
    assert project["tool"]["hatch"]["version"]["path"] == "src/ramsight/_version.py"
    assert releases[0] == ("Unreleased", "")
    version, day = releases[1]
    released = ramsight.__version__.partition(".dev")[0]  # of a version in the making nothing is released yet
    assert re.fullmatch(r"\d+\.\d+\.\d+", version)
    assert (version, version) == (released, citation["version"])
    assert str(date.fromisoformat(day)) == day == str(citation["date-released"])


def test_every_release_has_its_day_and_the_newest_stands_first(releases):
    versions = [tuple(map(int, name.split("."))) for name, _ in releases[1:]]
    days = [date.fromisoformat(day) for _, day in releases[1:]]
    assert versions == sorted(set(versions), reverse=True)
    assert days == sorted(days, reverse=True)


@pytest.mark.parametrize("sheet", sorted((ROOT / "docs" / "sheets").glob("*.html")), ids=lambda path: path.stem)
def test_a_stored_sheet_names_a_version_that_was_released(sheet, releases):
    (named,) = re.findall(r"measured\. ramsight (\S+?)</p>", sheet.read_text(encoding="utf-8"))
    assert named in dict(releases[1:])


def test_the_citation_has_what_its_format_asks_for(citation, project):
    assert set(citation) >= KEYS
    assert citation["cff-version"] == "1.2.0"
    assert citation["type"] == "software"
    assert citation["license"] == project["project"]["license"]
    assert [author["name"] for author in citation["authors"]] == [
        author["name"] for author in project["project"]["authors"]
    ]


def test_the_paper_is_cited_alike_in_the_citation_and_on_the_pages(citation):
    (paper,) = citation["references"]
    names = [f"{author['given-names']} {author['family-names']}" for author in paper["authors"]]
    page = " ".join(text_of("docs/reference/paper.md").split())
    assert page.partition("\n")[0].count(paper["title"].rstrip(".")) == 1
    assert f"{', '.join(names[:-1])} and {names[-1]}, *{paper['title']}*" in page
    cite = text_of("docs/cite.md")
    reversed_names = " and ".join(f"{author['family-names']}, {author['given-names']}" for author in paper["authors"])
    fields = dict(re.findall(r"^  (\w+) += \{(.*)\},$", cite.partition("@inproceedings")[2], flags=re.MULTILINE))
    assert (fields["title"], fields["author"]) == (paper["title"], reversed_names)
    assert (fields["year"], fields["pages"]) == (str(paper["year"]), f"{paper['start']}--{paper['end']}")


def test_the_page_that_cites_has_the_release(citation):
    software = text_of("docs/cite.md").partition("@inproceedings")[0]
    fields = dict(re.findall(r"^  (\w+) += \{(.*)\},$", software, flags=re.MULTILINE))
    wanted = {"title": "title", "version": "version", "date": "date-released", "license": "license"}
    assert {field: fields[field] for field in wanted} == {field: str(citation[key]) for field, key in wanted.items()}


def test_what_a_release_has_is_one_page():
    parts = re.split(r"^## \[", text_of("CHANGELOG.md"), flags=re.MULTILINE)[2:]
    assert parts
    assert max(len(part.splitlines()) for part in parts) <= 80


def test_classifiers_exist_and_agree_with_the_pythons_that_the_wheel_is_tried_on(project):
    trove = pytest.importorskip("trove_classifiers")
    given = project["project"]["classifiers"]
    assert [one for one in given if one not in trove.classifiers] == []
    pythons = re.findall(r"Python :: (3\.\d+)", "\n".join(given))
    (tried,) = re.findall(r"^VERSIONS = \((.*)\)", text_of("package/check.py"), flags=re.MULTILINE)
    assert pythons == re.findall(r"[\d.]+", tried)
    assert project["project"]["requires-python"] == f">={pythons[0]}"
    assert [file for file in project["project"]["license-files"] if not (ROOT / file).is_file()] == []


@pytest.fixture(scope="module")
def commands():
    """What each job of the workflow runs, a command a line."""
    jobs = loaded(".github/workflows/ci.yml")["jobs"]
    return {name: [step["run"] for step in job["steps"] if "run" in step] for name, job in jobs.items()}


def test_the_workflow_calls_the_script_of_the_whole_check(commands):
    (only,) = commands["whole"]
    assert only.endswith("bash .ci/run")
    assert (ROOT / ".ci" / "run").is_file()


def test_the_lowest_allowed_versions_are_those_of_every_extra_that_users_have(commands, project):
    (install,) = [command for command in commands["lowest"] if "lowest-direct" in command]
    extras = set(re.findall(r"--extra (\w+)", install))
    assert extras == set(project["project"]["optional-dependencies"]) - TOOLS


def test_every_dependency_of_users_has_a_lowest_version(project):
    named = [*project["project"]["dependencies"]]
    for extra, of_extra in project["project"]["optional-dependencies"].items():
        named += of_extra if extra not in TOOLS else []
    assert [one for one in named if ">=" not in one and not one.startswith("ramsight[")] == []


@pytest.fixture
def sbom(script):
    return script("sbom", "package")


def part(name, version="1.0"):
    return {"type": "library", "name": name, "version": version, "purl": f"pkg:pypi/{name}@{version}", "bom-ref": name}


def bill_of(**changed):
    bill = {
        "bomFormat": "CycloneDX", "specVersion": "1.6", "metadata": {"component": part("ramsight")},
        "components": [part("numpy"), part("casadi"), part("pip")],
        "dependencies": [{"ref": "ramsight", "dependsOn": ["casadi"]}, {"ref": "casadi", "dependsOn": ["numpy"]},
                         {"ref": "pip"}],
    }  # fmt: skip
    return {**bill, **changed}


def test_the_bill_of_materials_has_what_its_readers_look_for(sbom):
    bill = sbom.of_ramsight(bill_of(), "1.0")
    assert list(sbom.mistakes(bill)) == []
    assert [one["name"] for one in bill["components"]] == ["numpy", "casadi"], "pip is the environment's"
    for changed, says in (
        ({"specVersion": "1.0"}, "is no CycloneDX"),
        ({"metadata": {}}, "is not ramsight's"),
        ({"components": []}, "has no components"),
        ({"components": [{**part("casadi"), "purl": ""}]}, "casadi has no purl"),
        ({"dependencies": [{"ref": "ramsight", "dependsOn": ["scipy"]}]}, "depends on what is not in it: scipy"),
        ({"dependencies": []}, "says not what ramsight needs"),
    ):
        assert says in "; ".join(sbom.mistakes(bill_of(**changed)))


def test_without_its_program_there_is_no_bill(sbom, tmp_path, capsys):
    sbom.main(str(tmp_path / "cyclonedx-py"), "python", tmp_path / "x.json")
    assert capsys.readouterr().out.startswith("sbom: its program cannot be had here")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["dev", "docs"])
def test_every_pin_has_hashes(name):
    """Of more than one file where there are wheels for platforms: those of other Pythons, too."""
    pins = re.findall(
        r"^([\w.-]+)==(\S+)((?: \\\n    --hash=sha256:[0-9a-f]{64})+)$", text_of(f"requirements/{name}.txt"), re.M
    )
    assert len(pins) == len(re.findall(r"^\S", text_of(f"requirements/{name}.txt"), re.M)) > 10
    hashes = {pin: rest.count("--hash") for pin, _, rest in pins}
    assert all(hashes[one] > 20 for one in ("numpy", "pandas", "llvmlite") if one in hashes)
