"""The report of a run: its pages, and what it concludes from numbers. That it is whole is tested with `wam-cast reproduce`."""

import re
from copy import deepcopy
from dataclasses import replace

import pytest

from wam_cast.experiments.paper.report import FAILURES, render_markdown, worst_casts
from wam_cast.experiments.report_pages import render_html
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status


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


def test_page_has_a_table_of_contents_that_leads_to_each_heading(tmp_path):
    text = "# Title\n\nText.\n\n## Casts & `cups`\n\n### Where not\n\n## Casts: cups\n\n#### too deep\n"
    page = render_html(text, tmp_path)
    links = re.findall(r'<li class="(h\d)"><a href="#([\w-]+)">(.*?)</a>', page)
    assert links == [
        ("h2", "casts-cups", "Casts &amp; cups"),
        ("h3", "where-not", "Where not"),
        ("h2", "casts-cups-2", "Casts: cups"),
    ]
    assert re.findall(r'<(h\d) id="([\w-]+)">', page) == [(tag, anchor) for tag, anchor, _ in links]
    assert page.index("<h1>") < page.index("<nav>") < page.index("Text.")
    assert "<nav>" not in render_html("# Title\n\nText.\n", tmp_path)


@pytest.mark.slow
def test_in_the_contents_what_is_below_a_heading_stands_in_its_column(browser, tmp_path):
    text = "# Title\n\n" + "".join(f"{'##' if n % 3 else '###'} Heading {n}\n\n" for n in range(1, 12))
    page = browser.new_page(viewport={"width": 1100, "height": 800})
    page.set_content(render_html(text, tmp_path))
    lefts = page.evaluate("[...document.querySelectorAll('nav li')].map(li => li.getBoundingClientRect().left)")
    assert len(set(lefts)) == 3
    assert all(lefts[n - 1] == lefts[n - 2] for n in (3, 6, 9))


# --- conclusions


@pytest.fixture
def write(finished):
    """Return a function that changes the content of `results.json` and returns the report of it as Markdown."""
    findings, folder = finished
    content = findings.to_json({"casts": 1.0})

    def rendered(change=lambda _: None, **scenario):
        changed, settings = deepcopy(content), findings.settings
        change(changed)
        other = settings.scenario.model_copy(update=scenario)
        return render_markdown(changed, replace(settings, scenario=other), folder)

    return rendered


def change_rows(values):
    """Return what sets values of estimators."""

    def change(content):
        for row in content["comparison"]["rows"]:
            row |= values.get(row["name"], {})

    return change


@pytest.mark.parametrize(("rmse", "median", "is_heavy"), [(0.0018, 0.00035, True), (0.0018, 0.0012, False)])
def test_errors_have_a_heavy_tail_if_their_median_is_far_below_their_rmse(write, rmse, median, is_heavy):
    markdown = write(change_rows({"ard": {"rmse": rmse, "median": median}}))
    assert f"{1e3 * median:.2f} mm by the kernel regression" in markdown
    assert ("heavy tail" in markdown) is is_heavy


def test_rows_are_said_to_overlap_if_their_intervals_do(write):
    def change(low_of_others):
        def function(content):
            for i, row in enumerate(content["comparison"]["rows"]):
                row |= {"rmse": 0.01 + 0.1 * i, "rmse_interval": [0.005 if i == 0 else low_of_others, 2.0]}
            content["comparison"]["rows"][0]["rmse_interval"] = [0.005, 0.02]

        return function

    assert "their order may be another" not in write(change(0.03))
    assert "their order may be another" in write(change(0.01))


REFERENCE_POLYNOMIALS = {"raw": 0.009, "additive": 0.093, "distance": 0.18, "speed": 0.176, "wait": 0.11}
"""Test RMSE of the variants over the reference dataset [m], about."""


LIKE_A_MEAN = "told hardly more than a mean"
NOT_AS_BAD = "Neither poor conditioning nor missing products"
LIKE_CURVES = "A curve in the distance alone and in the speed alone comes within 20 %"


@pytest.mark.parametrize(
    ("mean", "changes", "sentences"),
    [
        (0.185, {}, {LIKE_A_MEAN, NOT_AS_BAD, LIKE_CURVES}),
        (0.30, {}, {NOT_AS_BAD, LIKE_CURVES}),
        (0.185, {"additive": 0.2}, {LIKE_A_MEAN, LIKE_CURVES}),
        (0.185, {"distance": 0.1, "speed": 0.3}, {LIKE_A_MEAN, NOT_AS_BAD}),
    ],
)
def test_the_papers_polynomial_is_judged_by_the_numbers_beside_it(write, mean, changes, sentences):
    def change(content):
        change_rows({"constant": {"rmse": mean}})(content)
        values = (REFERENCE_POLYNOMIALS | changes).values()
        for row, value in zip(content["comparison"]["variants"], values, strict=True):
            row["test_rmse"] = value

    markdown = write(change)
    assert {one for one in (LIKE_A_MEAN, NOT_AS_BAD, LIKE_CURVES) if one in markdown} == sentences
    assert ("Bishop" in markdown) is (LIKE_CURVES in sentences)


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        ([0.003, 0.002, 0.0017, 0.005, 0.019], "explain some of its 2.24 cm: ours errs by 1.90 cm with a lambda of 1."),
        ([0.003, 0.002, 0.0017, 0.005, 0.03], "explain all of its 2.24 cm"),
        ([0.003, 0.002, 0.0017, 0.002, 0.0021], None),
        ([None, 0.002, 0.0017, 0.002, None], None),
        ([1e-4, 1e-4, 1e-4, 1e-4, 3e-4], None),  # no part of 2.24 cm
        ([0.03, 0.03, 0.03, 0.03, 0.1], None),  # a small one errs as much
    ],
)
def test_a_large_lambda_explains_only_what_the_curve_shows(write, errors, words):
    markdown = write(lambda c: c["selection"]["papers_curve"].update(validation_rmse=errors))
    assert ("could explain" in markdown) is (words is not None)
    assert (words or "") in markdown


@pytest.mark.parametrize("n_fast", [0, 4, 80])
def test_the_worst_casts_are_called_fast_if_they_are_and_others_are_not(write, n_fast):
    def change(content):
        held_out = content["comparison"]["held_out"]
        held_out["residual"] = [0.1] * 4 + [0.001] * 76
        held_out["speed"] = [0.8] * n_fast + [0.4] * (80 - n_fast)

    markdown = write(change)
    share = 25 * min(n_fast, 4)
    assert f"Of these {share} % are faster than 0.7 m/s, of all casts {100 * n_fast / 80:.0f} %" in markdown
    assert ("errs most where the hand is fast" in markdown) is (n_fast == 4)


def test_worst_casts_are_counted():
    scenario = Scenario()
    (d0, d1), (s0, s1), (w0, w1) = scenario.bounds.distance, scenario.bounds.speed, scenario.bounds.wait
    held_out = {
        "worst": 0.5,
        "residual": [-0.2, 0.1, 0.01, 0.0],
        "distance": [(d0 + d1) / 2, d0 + 0.01 * (d1 - d0), (d0 + d1) / 2, d0],
        "speed": [0.71, 0.5, 0.71, 0.71],
        "wait": [(w0 + w1) / 2] * 4,
    }
    assert s0 < 0.5 < 0.71 < s1
    assert worst_casts(held_out, scenario) == {"fast": 0.5, "all_fast": 0.75, "edge": 0.5}


def test_the_learning_curves_say_who_errs_least_and_who_is_alike(write):
    def change(content):
        curves = {"A": [3.0, 2.0, 1.0], "B": [2.0, 1.5, 1.1], "C": [4.0, 4.0, 4.0]}
        content["learning_curves"] |= {
            "n_train": [25, 50, 100],
            "curves": {name: dict.fromkeys(("median", "low", "high"), band) for name, band in curves.items()},
        }

    markdown = write(change)
    assert "estimator of least median error: B with 25 and 50 casts; A with 100 casts." in markdown
    assert "With all casts 2 estimators are alike, within 20 % of the least error: A; B." in markdown
    assert "are alike" not in write(lambda c: (change(c), c["learning_curves"]["curves"].pop("B")))


@pytest.mark.parametrize(
    ("off", "words"), [(0.1, "10.0 % of the casts more"), (-0.1, "10.0 % of the casts fewer"), (0.01, "1.0 %")]
)
def test_intervals_are_too_wide_or_too_narrow_by_their_coverage(write, off, words):
    def change(content):
        shares = content["comparison"]["coverage"]
        content["comparison"]["empirical"] = {"KRR": [share + off for share in shares]}

    markdown = write(change)
    assert f"KRR: intervals hold {words}" in markdown
    assert ("too wide, the curve is above the diagonal" in markdown) is (off == 0.1)
    assert ("too narrow, the curve is below the diagonal" in markdown) is (off == -0.1)


def test_a_curve_that_crosses_the_diagonal_is_on_neither_side(write):
    def change(content):
        shares = content["comparison"]["coverage"]
        content["comparison"]["empirical"] = {"KRR": [shares[0] - 0.01, *(share + 0.1 for share in shares[1:])]}

    markdown = write(change)
    assert "they are too wide." in markdown
    assert "the diagonal" not in markdown


def test_the_side_of_the_descents_plans_is_counted(write):
    def change(content):
        (papers,) = (one for one in content["executions"] if one["planner"] == "gradient")
        for i, trial in enumerate(papers["trials"]):
            trial["predicted_offset"] = -0.005 if i < 5 else 0.005

    assert "5 of its 6 plans are short of the middle" in write(change)


@pytest.mark.parametrize(("radius", "is_easier"), [(0.03, False), (0.05, True)])
def test_a_wide_cup_is_easier(write, radius, is_easier):
    cup = Scenario().cup.model_copy(update={"inner_radius": radius})
    easier, harder = write(cup=cup).split("Not easier:")
    sentence = f"The cup's inner radius is {100 * radius:.1f} cm, the paper's 3 cm."
    assert (sentence in easier) is is_easier
    assert (sentence in harder) is not is_easier


def test_casts_are_rarer_only_where_the_shortest_move_forbids_some(write):
    assert "are rarer than others" in write()
    motion = Scenario().motion.model_copy(update={"min_move_duration": 0.01})
    assert "are rarer than others" not in write(motion=motion)
