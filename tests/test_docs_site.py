"""docs/check.py sees pages without a title, Markdown that was not rendered, and links to nowhere."""

import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture
def check(script):
    return script("check", "docs")


def page(title="Logs", body="<p>text</p>"):
    return f"<html><head><title>{title}</title></head><body><h1>Logs</h1>{body}</body></html>"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (page(title="&lt;no title&gt; - ramsight"), "has no title"),
        (page(title=" "), "has no title"),
        ("<p>text</p>", "has no title"),
        (page(body="<p>see [logs](logs.md)</p>"), "shows Markdown: ](logs.md)"),
        (page(body="<p># Examples</p>"), "shows Markdown: # E"),
        (page(body="<p>\n- [one](one.py): a</p>"), "shows Markdown: - ["),
        (page(body="<p>it is **bold** here</p>"), "shows Markdown: **bold**"),
        (page(body="<p>```sh</p>"), "shows Markdown: ```"),
        (page(body="<a href='gone.html'>gone</a>"), "gone.html is not there"),
        (page(body="<img src='https://example.org/a.png'>"), "fetches https://example.org/a.png"),
    ],
)
def test_a_page_with_a_fault_is_seen(check, tmp_path, text, fault):
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    assert f"page.html: {fault}" in check.faults(tmp_path)


@pytest.mark.parametrize(
    "body",
    [
        "<pre>**kwargs, [a](b.md)</pre><p>after</p>",
        "<p><code># comment</code> and <em>**kwargs)\nVariables: **others</em></p>",
        "<svg><title>&lt;no title&gt;</title></svg><script>a['b'](c); // # d</script>",
    ],
)
def test_code_and_signatures_are_no_markdown(check, tmp_path, body):
    (tmp_path / "page.html").write_text(page(body=body), encoding="utf-8")
    assert check.faults(tmp_path) == []


@pytest.fixture
def _chromium():
    pytest.importorskip("playwright.sync_api")
    if not (shutil.which("chromium") or shutil.which("chromium-browser")):
        pytest.skip("needs a Chromium")


@pytest.mark.usefixtures("_chromium")
def test_a_table_or_an_output_that_is_too_wide_is_seen(check, tmp_path):
    style = "<style>pre, .table-wrapper {width: 700px; overflow: auto}</style>"
    bodies = {"narrow": "<pre>a</pre>", "page": "<p style='width: 2000px'>a</p>", "wide": f"<pre>{'a' * 500}</pre>"}
    for name, body in bodies.items():
        (tmp_path / f"{name}.html").write_text(page(body=f"{style}<article>{body}</article>"), encoding="utf-8")
    found = check.in_browser(tmp_path)
    assert [line.partition(":")[0] for line in found] == ["page.html", "wide.html"]


@pytest.mark.slow
@pytest.mark.usefixtures("_chromium")
def test_a_picture_that_is_missing_in_the_dark_theme_is_seen(check, tmp_path):
    dark = (ROOT / "docs" / "_static" / "dark.css").read_text(encoding="utf-8")
    body = "<img src='plot.png'><img src='studio-live.png'>"
    for name, style, theme in (
        ("lit", dark, "auto"), ("unlit", "", "auto"), ("chosen", dark, "light"), ("other", "", None),
    ):  # fmt: skip
        text = page(body=f"<style>{style}</style>{body}")
        attribute = "" if theme is None else f" data-theme='{theme}'"
        (tmp_path / f"{name}.html").write_text(text.replace("<body>", f"<body{attribute}>"), encoding="utf-8")
    found = [line for line in check.in_browser(tmp_path) if not line.startswith("chosen")]
    assert found == [f"unlit.html: {one} is missing in the dark theme" for one in ("plot.png", "studio-live.png")]
    chosen = [line for line in check.in_browser(tmp_path) if line.startswith("chosen")]
    assert len(chosen) == 2, "a reader who chose the light theme has the pictures as they are"


def test_the_header_of_the_gallery_is_found_before_the_list_of_examples():
    """Sphinx-gallery takes the first of GALLERY_HEADER and README with .txt, then those with .md, then with .rst."""
    header = ROOT / "examples" / "GALLERY_HEADER.txt"
    assert header.read_text(encoding="utf-8").startswith("Examples\n========\n")
