"""The report on unknown robots: figures, `results.json`, Markdown, and one HTML page."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.experiments.frames import to_plain
from wam_cast.experiments.report_pages import report_environment, write_pages
from wam_cast.experiments.transfer.one_robot import STREAK
from wam_cast.experiments.transfer.transfer_settings import BEST, CUPS, MAIN_KS, OUT_OF_RANGE, TransferSettings
from wam_cast.experiments.transfer.transfer_summary import TransferSummary, share_within
from wam_cast.storage.run_directory import RunDirectory
from wam_cast.visualization.figures.transfer_figures import draw_bias, draw_campaigns, draw_hit_rates
from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.style import figure_style

DPI = 180
"""Of a PNG."""

SIZE = (8.2, 3.2)
"""Of a figure [in]."""

SOON, STREAK_SOON = 2, 12
"""Casts within which a first catch and ten catches in a row are counted."""


def write_report(summary: TransferSummary, settings: TransferSettings, directory: RunDirectory) -> None:
    """Write the report's files; what was there before is replaced."""
    folder = directory.folder("figures")
    with figure_style():
        for name, draw in (("bias", _bias), ("hit-rates", _hit_rates), ("campaigns", _campaigns)):
            for suffix in ("png", "pdf"):
                figure = Figure(figsize=SIZE, layout="constrained")
                draw(figure, summary, settings)
                write_figure(figure, folder / f"{name}.{suffix}", dpi=DPI)
    results = to_plain(
        {
            "settings": settings.identity | {"n_robots": settings.n_robots},
            "wall_seconds": directory.wall_seconds(),
            **{name: getattr(summary, name).to_dict("records") for name in type(summary).model_fields},
        }
    )
    write_pages(results, render_markdown(summary, settings, directory.path), directory.path)


def render_markdown(summary: TransferSummary, settings: TransferSettings, folder: Path) -> str:
    """Return the report as Markdown; it lies in `folder`, and its figures in `folder / "figures"`."""
    environment = report_environment(Path(__file__).parent)
    groups = [group.name for group in settings.groups]
    campaigns = {group: summary.campaigns[summary.campaigns["group"] == group] for group in groups}
    return environment.get_template("transfer_report.md.j2").render(
        s=settings,
        groups=groups,
        best=BEST,
        main_ks=[k for k in settings.ks if k in MAIN_KS],
        cups=list(CUPS),
        out_of_range=list(OUT_OF_RANGE),
        bias=summary.bias.to_dict("records"),
        hits=summary.hits.to_dict("records"),
        calibration=summary.calibration.to_dict("records"),
        campaigns={
            group: {
                "n": len(some),
                "first": share_within(some, "first_catch", SOON),
                "streak": share_within(some, "streak_end", STREAK_SOON),
                "latest_first": some["first_catch"].max(skipna=False),
                "median_streak": some["streak_end"].median(),
            }
            for group, some in campaigns.items()
        },
        soon=SOON,
        streak_soon=STREAK_SOON,
        streak=STREAK,
        command=settings.command(folder),
    )


def _panels(figure: Figure, settings: TransferSettings) -> dict[str, Axes]:
    panels = figure.subplots(1, len(settings.groups), sharey=True, squeeze=False)[0]
    return {group.name: axes for group, axes in zip(settings.groups, panels, strict=True)}


def _bias(figure: Figure, summary: TransferSummary, settings: TransferSettings) -> None:
    for group, axes in _panels(figure, settings).items():
        of_group = summary.bias[summary.bias["group"] == group]
        curves = {
            str(method): (rows["k"].to_numpy(dtype=float), rows["p95"].to_numpy(dtype=float))
            for method, rows in of_group.groupby("method", sort=False)
        }
        draw_bias(axes, curves, title=group)
        axes.label_outer()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False)


def _hit_rates(figure: Figure, summary: TransferSummary, settings: TransferSettings) -> None:
    best = summary.hits[summary.hits["method"] == BEST]
    for group, axes in _panels(figure, settings).items():
        curves = {
            str(cup): rows[["k", "rate", "low", "high"]].to_numpy(dtype=float).T
            for cup, rows in best[best["group"] == group].groupby("cup", sort=False)
        }
        draw_hit_rates(axes, curves, title=group)
        axes.label_outer()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)


def _campaigns(figure: Figure, summary: TransferSummary, settings: TransferSettings) -> None:
    for group, axes in _panels(figure, settings).items():
        some = summary.campaigns[summary.campaigns["group"] == group]
        draw_campaigns(axes, some["first_catch"].to_numpy(), some["streak_end"].to_numpy(), title=group)
        axes.label_outer()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
