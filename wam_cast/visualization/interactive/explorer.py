"""Explorer: casts chosen with sliders in the browser, what the model predicts of them, and what becomes of them."""

from __future__ import annotations

import asyncio
import html
import math
import time
from dataclasses import asdict

import numpy as np
from pydrake.geometry import Meshcat

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast, cast_bounds, checked_cup, nearest_allowed
from wam_cast.casting_plane import from_polar, to_polar
from wam_cast.errors import InputError
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model_for
from wam_cast.motion.stages import Stage
from wam_cast.planning.cast_prediction import Prediction
from wam_cast.planning.plan import Plan, plan_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.visualization.interactive.explorer_view import EXECUTED, PLANE, PREDICTED, WITHIN_REACH, ExplorerView
from wam_cast.visualization.interactive.panel import Panel, Slider, swatch
from wam_cast.visualization.recorded import finite_part, without_turn
from wam_cast.visualization.style import STAGE_COLORS, stage_name, status_name
from wam_cast.visualization.viewer import check_main_thread

CAST, PLAN, FETCH = "cast [C]", "plan for the cup [P]", "cup to where the ball landed [L]"
"""The buttons."""

PERIOD = 0.05
"""Polling interval of the page [s]."""

ADVICE = "make one with: wam-cast generate, then wam-cast fit"
"""To whom has no model."""


class Explorer:
    """A page with sliders for the cast and the cup, at `url`, and buttons that cast, plan, and move the cup to the ball.

    The cup has polar coordinates about the base axis, as the cast has: so it stands in the casting plane if both bearings are
    the same, and all of a slider's way is floor. Nothing here waits for the page: call `poll` now and then, `run` in a
    program, or `asyncio.create_task(explorer.follow())` in a notebook, where the page then lives on from cell to cell. All of it
    in the main thread, to which a page of Drake's belongs; elsewhere it raises `.InputError`.

    Parameters
    ----------
    scenario
        What is explored; the reference scenario without one.
    model
        Predicts its casts. Without one the model that the package ships does, if it serves the scenario; else there is no
        prediction and no plan, and the page says so.
    advice
        How to get a model, for the page to say.
    host, port
        Where the page is served, as for `.open_meshcat`: to this machine alone, on a free port. There is no password: elsewhere
        whoever reaches the page can use it.

    Attributes
    ----------
    cast, cup
        What is chosen: the `.Cast`, and world (x, y) of the cup's axis [m].
    prediction
        What the model says of it; none without a model.
    outcome
        Of the last cast that was executed; none before.
    scenario, model, advice
        As given, or found.
    """

    def __init__(
        self,
        scenario: Scenario | None = None,
        model: ForwardModel | None = None,
        advice: str = ADVICE,
        *,
        host: str = "localhost",
        port: int = 0,
    ) -> None:
        check_main_thread("Explorer")
        self.scenario = Scenario() if scenario is None else scenario
        model = reference_model_for(self.scenario) if model is None else model.bound_to(self.scenario)
        self.model = model
        self.prediction: Prediction | None = None
        self.outcome: Outcome | None = None
        self.advice = advice
        self._simulator = CastSimulator(self.scenario)
        reach = None if model is None else model.reach
        self._view = ExplorerView(self.scenario, reach, _farthest(self.scenario), host=host, port=port)
        self._actions = {CAST: self.execute, PLAN: self.plan, FETCH: self.move_cup_to_ball}
        self._panel = Panel(self.meshcat, _sliders(self.scenario), {CAST: "KeyC", PLAN: "KeyP", FETCH: "KeyL"})
        self._n_casts, self._note = 0, ""
        self.cast = Cast.from_array(nearest_allowed(self.scenario, np.mean(cast_bounds(self.scenario), axis=0)))
        self.cup = (self.scenario.motion.start_radius + self.cast.distance, 0.0)
        if model is not None:
            landing = Prediction.of(model, self.cast, self.cup).landing
            self.cup = float(landing[0]), float(landing[1])
        self._refresh()

    @property
    def url(self) -> str:
        """Of the page, for a browser on this machine; it is there for as long as the explorer is."""
        return str(self.meshcat.web_url())

    @property
    def meshcat(self) -> Meshcat:
        """The Meshcat that serves the page."""
        return self._view.meshcat

    def choose(self, cast: Cast | None = None, cup: tuple[float, float] | None = None) -> None:
        """Choose a cast, moved to what is allowed, and a cup at world (x, y) [m]; the sliders follow.

        Raises `.InputError` if the cup's coordinates are not finite numbers.
        """
        check_main_thread("Explorer")
        if cup is not None:
            self.cup = checked_cup(cup)
        if cast is not None:
            allowed = nearest_allowed(self.scenario, cast.to_array())
            self.cast = Cast.from_array(allowed, np.clip(cast.bearing, *arm_model(self.scenario.arm).bearing_limits))
        self._note = ""
        self._refresh()

    def execute(self) -> Outcome:
        """Simulate the chosen cast with contact, and replay it on the page; with noise each time another."""
        self._say("simulating ...")
        recording = self._simulator.record(self.cast, self.cup, noise_seed=self._n_casts, returns=False)
        self._n_casts += 1
        self.outcome = recording.outcome
        self._view.show_execution(without_turn(finite_part(recording)))
        self._say(_verdict(recording.outcome))
        return recording.outcome

    def plan(self) -> Plan | None:
        """Choose the best cast for the cup where it stands; if there is none, say why on the page and return none."""
        if self.model is None:
            self._say("no plan without a model: see below")
            return None
        self._say("planning ...")
        try:
            plan = plan_cast(self.model, self.cup)
        except InputError as error:
            self._say(str(error))
            return None
        self.choose(plan.cast)
        self._say("planned" if plan.is_feasible else f"no cast is predicted to end in the cup: {plan.reason}")
        return plan

    def move_cup_to_ball(self) -> None:
        """Stand the cup where the last ball came down through the rim plane."""
        if self.outcome is None or not np.all(np.isfinite(self.outcome.landing)):
            self._say("no ball has landed yet: cast first")
            return
        x, y = self.outcome.landing
        self.choose(cup=(float(x), float(y)))

    def poll(self) -> bool:
        """Do what was asked for on the page since the last call, and return whether there was anything."""
        check_main_thread("Explorer")
        pressed = self._panel.pressed()  # before the sliders, which may have been moved before the press
        moved = self._panel.moved()
        if moved:
            values = self._values() | moved
            cup = from_polar(values.pop("cup_distance"), values.pop("cup_bearing"))
            self.choose(Cast(**values), cup if {"cup_distance", "cup_bearing"} & set(moved) else None)
        for name in pressed:
            self._actions[name]()
        return bool(pressed or moved)

    def run(self) -> None:
        """Follow the page until interrupted."""
        while True:
            self.poll()
            time.sleep(PERIOD)

    async def follow(self) -> None:
        """Follow the page in the running event loop, until cancelled."""
        while True:
            self.poll()
            await asyncio.sleep(PERIOD)

    def _values(self) -> dict[str, float]:
        """Return what is chosen by the sliders' keys, in SI units."""
        distance, bearing = to_polar(self.cup)
        return asdict(self.cast) | {"cup_distance": distance, "cup_bearing": bearing}

    def _refresh(self) -> None:
        """Show what is chosen and what is predicted of it."""
        self._panel.show(self._values())
        self._view.show_setting(self.cast, self.cup)
        if self.model is not None:
            self.prediction = Prediction.of(self.model, self.cast, self.cup)
            self._view.show_prediction(self.prediction.landing, self.prediction.std, self.cast.bearing)
        self._panel.caption = self._caption()

    def _say(self, note: str) -> None:
        """Write a note at the top of the page."""
        check_main_thread("Explorer")
        self._note = note
        self._panel.caption = self._caption()

    def _caption(self) -> str:
        """Return the page's text: a note or the last cast's end, the cup, the prediction, and what the colours mean."""
        state = "open the controls, and cast" if self.outcome is None else f"last cast: {_verdict(self.outcome)}"
        headline, (x, y) = self._note or state, self.cup
        text = "<br>".join(html.escape(line) for line in (f"cup at ({x:.3f}, {y:.3f}) m", *self._prediction_lines()))
        return f"<b>{html.escape(headline[:1].upper() + headline[1:])}</b><br>{text}{self._legend()}"

    def _prediction_lines(self) -> list[str]:
        if self.prediction is None:
            return [f"no prediction, since this scenario has no model: {self.advice}"]
        one = self.prediction
        lines = [
            f"predicted to land {1e3 * one.miss:.1f} mm from the cup's middle; standard deviation "
            f"{1e3 * one.std.along:.1f} mm along the casting plane, {1e3 * one.std.across:.1f} mm across",
            f"chance to enter without touching the rim: {100 * one.rim_clear_probability:.0f} %",
        ]
        if max(one.peak_torque_utilization, one.peak_velocity_utilization) >= 1:
            lines.append("the arm is predicted to meet its limits")
        return lines

    def _legend(self) -> str:
        """Return what the colours mean, as HTML."""
        rows = [
            swatch(EXECUTED, "&#9679;", "executed landing"),
            "(at the height of the rim, and of the cup's foot)",
            swatch(PLANE, "&#9644;", "casting plane"),
        ]
        if self.model is not None:
            rows.insert(0, swatch(PREDICTED, "&#9711;", "predicted landing, with 2 standard deviations"))
            rows.append(swatch(WITHIN_REACH, "&#9632;", "floor that plans reach"))
        stages = (Stage.MOVE, Stage.WAIT, Stage.DROP, Stage.HOLD)
        paths = " ".join(swatch(STAGE_COLORS[one], "&#9644;", stage_name(one)) for one in stages)
        lines = "".join(f"<div>{row}</div>" for row in [*rows, "hand's way to come, ball's path:", paths])
        return f'<div class="legend">{lines}</div>'


def _sliders(scenario: Scenario) -> dict[str, Slider]:
    """Return the sliders by what they choose; angles in tenths of a degree, within the stops of joint 1."""
    bounds = scenario.bounds
    degrees = math.degrees(1.0)
    lowest, highest = (math.trunc(10 * degrees * limit) / 10 for limit in arm_model(scenario.arm).bearing_limits)
    return {
        "distance": Slider("distance [m]", *bounds.distance, 0.001),
        "speed": Slider("speed [m/s]", *bounds.speed, 0.001),
        "wait": Slider("wait [s]", *bounds.wait, 0.001),
        "bearing": Slider("bearing [deg]", lowest, highest, 0.1, degrees),
        "cup_distance": Slider("cup distance [m]", scenario.motion.start_radius / 2, _farthest(scenario), 0.001),
        "cup_bearing": Slider("cup bearing [deg]", lowest, highest, 0.1, degrees),
    }


def _farthest(scenario: Scenario) -> float:
    """Return how far from the base axis a ball could land at all [m]: at the farthest hand's, the string level."""
    return scenario.motion.start_radius + scenario.bounds.distance[1] + scenario.string.length


def _verdict(outcome: Outcome) -> str:
    """Return in words what became of a cast."""
    facts = [status_name(outcome.status)]
    if math.isfinite(outcome.miss):
        facts.append(f"miss {1e3 * outcome.miss:.1f} mm")
    return ", ".join([*facts, *outcome.limits_hit])
