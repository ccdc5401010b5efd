"""The report of a run: complete, self-contained, and of the run's own numbers."""

import json
import re
from html.parser import HTMLParser

import pytest

from wam_cast.experiments.paper.report import FAILURES, render_html, write_report
from wam_cast.experiments.paper.report_figures import CAPTIONS, draw_figures
from wam_cast.parallel.workers import Workers
from wam_cast.simulation.outcome import Status
from wam_cast.storage.run_directory import RunDirectory


class Page(HTMLParser):
    """Collects what a page refers to, and its tables."""

    def __init__(self):
        super().__init__()
        self.sources, self.links, self.rows = [], [], []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if tag == "img":
            self.sources.append(attrs["src"])
        if tag == "link" or tag == "script":
            self.links.append(attrs)
        if tag == "tr":
            self.rows.append([])

    def handle_data(self, data):
        if self.rows and data.strip():
            self.rows[-1].append(data.strip())


def check_figures(folder, markdown):
    for name in CAPTIONS:
        for suffix in ("pdf", "png"):
            assert (folder / "figures" / f"{name}.{suffix}").stat().st_size > 2000
        assert f"figures/{name}.png" in markdown


def check_text(findings, folder, markdown):
    assert "nan" not in re.findall(r"[a-z]+", markdown.lower())
    assert "{{" not in markdown
    assert "{%" not in markdown
    results = json.loads((folder / "results.json").read_text())
    assert results["wall_s"] == pytest.approx(sum(results["wall_s_by_phase"].values()))
    assert f"{100 * results['test_rmse_m']['isotropic']:.2f} cm" in markdown
    assert findings.settings.scenario.fingerprint in markdown
    assert f"`wam-cast reproduce --seed 0 --out {folder} --quick`" in markdown


def check_tables(markdown):
    tables = re.findall(r"(?:^\|.*\|[ \t]*\n)+", markdown, re.MULTILINE)
    assert len(tables) > 8
    for table in tables:
        assert len({line.count("|") for line in table.splitlines()}) == 1, table


def check_missed_cups_are_explained(findings, markdown):
    missed = [
        trial
        for execution in (*findings.executions, *findings.noise.executions)
        for trial in execution.trials
        if not trial.is_caught
    ]
    assert missed  # the noise sees to it
    for trial in missed:
        assert f"cup at {100 * trial.cup:.1f} cm" in markdown


def check_page_needs_nothing_but_itself(folder):
    page = Page()
    page.feed((folder / "report.html").read_text())
    assert len(page.sources) == len(CAPTIONS)
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert not page.links


@pytest.mark.slow
def test_report_is_whole(no_physics, finished):
    # One test, since its figures take their time.
    findings, folder = finished
    directory = RunDirectory(folder, findings.settings.identity, findings.settings.own_scenario)
    assert list(draw_figures(findings, directory.figures, Workers())) == list(CAPTIONS)
    write_report(findings, directory)
    markdown = (folder / "report.md").read_text()
    check_figures(folder, markdown)
    check_text(findings, folder, markdown)
    check_tables(markdown)
    check_missed_cups_are_explained(findings, markdown)
    check_page_needs_nothing_but_itself(folder)


def test_every_failure_has_a_word():
    failures = {status.value for status in Status} - {"caught", "landed"}
    assert set(FAILURES) == failures


def test_markdown_becomes_a_page(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "a.png").write_bytes(b"picture")
    page = render_html("# Title\n\n|a|b|\n|-|-|\n|1|2|\n\n![x](figures/a.png)\n", tmp_path)
    assert "<title>Title</title>" in page
    assert "<td>1</td>" in page
    assert "data:image/png;base64,cGljdHVyZQ==" in page
