"""Explorer: what is chosen, predicted, planned and executed, without a browser."""

import base64
import math
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import msgpack
import numpy as np
import pytest

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast, is_allowed
from wam_cast.errors import InputError
from wam_cast.learning.reference import reference_model
from wam_cast.planning.plan import plan_cast
from wam_cast.scenario import Arm, Motion, Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.visualization.interactive import explorer as explorer_module
from wam_cast.visualization.interactive.explorer import CAST, FETCH, PLAN, Explorer, Prediction

HEAVY = {"ball": {"mass": 0.04}}


class Page:
    """An explorer and what a browser would send and show."""

    def __init__(self, scenario=None, **options):
        self.explorer = Explorer(scenario, **options)
        self.meshcat = self.explorer.meshcat

    def move(self, **values):
        for name, value in values.items():
            (label,) = [
                label for label in self.meshcat.GetSliderNames() if label.split(" [")[0] == name.replace("_", " ")
            ]
            self.meshcat.SetSliderValue(label, value)
        return self.explorer.poll()

    def press(self, button):
        self.meshcat._InjectWebsocketMessage(message=msgpack.packb({"type": "button", "name": button}))
        return self.explorer.poll()

    def sliders(self):
        return {name.split(" [")[0]: self.meshcat.GetSliderValue(name) for name in self.meshcat.GetSliderNames()}

    @property
    def caption(self):
        return self.explorer._panel.caption

    def is_visible(self, marker):
        packed = self.meshcat._GetPackedProperty(path=f"/explorer/{marker}", property="visible")
        return msgpack.unpackb(packed)["value"]

    def position(self, path):
        matrix = msgpack.unpackb(self.meshcat._GetPackedTransform(path=path))["matrix"]
        return np.array(matrix).reshape(4, 4).T[:2, 3]

    def replayed(self):
        """Return the paths of all that moves or appears in the replay that the page plays."""
        packed = map(base64.b64decode, re.findall(r'base64,([A-Za-z0-9+/=]+)"', self.meshcat.StaticHtml()))
        (message,) = (data for data in packed if b"set_animation" in data[:40])
        return {part["path"] for part in msgpack.unpackb(message)["animations"]}


@pytest.fixture(scope="module")
def module_page():
    return Page()


@pytest.fixture
def page(module_page):
    """Return the page of the reference scenario as it is at first; an executed cast stays."""
    module_page.explorer.choose(Cast(0.3, 0.6, 0.1), (0.75, 0.1))
    module_page.explorer.poll()
    return module_page


@pytest.fixture(scope="module")
def page_without_model():
    return Page(Scenario.from_dict(HEAVY), advice="go and <fit> it")


@pytest.mark.slow
def test_at_first_the_cup_stands_where_an_allowed_cast_is_predicted_to_land():
    for shortest in (0.2, 0.6):
        explorer = Explorer(Scenario.from_dict({"motion": {"min_move_duration": shortest}}))
        assert is_allowed(explorer.scenario, explorer.cast.to_array())
        if explorer.model is not None:
            assert explorer.prediction.miss < 1e-4
            np.testing.assert_allclose(explorer.cup, explorer.prediction.landing, atol=1e-4)
    assert explorer.model is None
    assert explorer.cast.move_duration == pytest.approx(0.6)


def test_sliders_show_what_is_chosen(page):
    expected = {"distance": 0.3, "speed": 0.6, "wait": 0.1, "bearing": 0.0}
    cup = {"cup distance": math.hypot(0.75, 0.1), "cup bearing": math.degrees(math.atan2(0.1, 0.75))}
    assert page.sliders() == pytest.approx(expected | cup, abs=0.05)
    assert page.sliders()["cup distance"] == pytest.approx(cup["cup distance"], abs=5e-4)


def test_sliders_choose_the_cast_and_the_prediction_follows(page):
    explorer = page.explorer
    assert page.move(distance=0.25, speed=0.5, wait=0.2, bearing=-30.0)
    cast = explorer.cast
    assert (cast.distance, cast.speed, cast.wait) == pytest.approx((0.25, 0.5, 0.2))
    assert cast.bearing == pytest.approx(math.radians(-30))
    along = reference_model().predict(cast.to_array()[np.newaxis])[0, 0]
    landing = [along * math.cos(cast.bearing), along * math.sin(cast.bearing)]
    np.testing.assert_allclose(explorer.prediction.landing, landing, atol=1e-4)
    assert explorer.prediction.miss == pytest.approx(math.dist(landing, explorer.cup), abs=1e-4)
    np.testing.assert_allclose(page.position("/explorer/predicted"), explorer.prediction.landing)
    assert page.is_visible("predicted")
    assert f"{1e3 * explorer.prediction.miss:.1f} mm from the cup" in page.caption
    assert not explorer.poll()


def test_cup_moves_about_the_base_axis_and_the_cast_stays(page):
    cast = page.explorer.cast
    page.move(cup_distance=0.5, cup_bearing=90.0)
    np.testing.assert_allclose(page.explorer.cup, [0, 0.5], atol=1e-12)
    assert page.explorer.cast == cast
    assert "(0.000, 0.500)" in page.caption


def test_all_bearings_of_the_sliders_are_within_the_stops_and_reach_them(page):
    for stop, far in zip(arm_model(Arm()).bearing_limits, (-400.0, 400.0), strict=True):
        page.move(bearing=far)
        assert abs(page.explorer.cast.bearing) <= abs(stop)
        assert page.explorer.cast.bearing == pytest.approx(stop, abs=0.002)
        page.explorer.choose(Cast(0.3, 0.6, 0.1, bearing=math.copysign(3.1, stop)))
        assert page.explorer.cast.bearing == stop


def test_too_fast_a_move_is_slowed_down_and_its_slider_says_so(page):
    page.move(distance=0.06, speed=0.85)
    assert page.explorer.cast.speed == pytest.approx(0.3)
    assert page.sliders()["speed"] == pytest.approx(0.3)
    assert is_allowed(page.explorer.scenario, page.explorer.cast.to_array())
    assert not page.explorer.poll()


def test_a_plan_is_chosen_to_the_last_digit_until_a_slider_moves(page):
    page.move(cup_distance=0.6, cup_bearing=40.0)
    page.press(PLAN)
    cup = page.explorer.cup
    assert page.explorer.cast == plan_cast(reference_model(), cup).cast
    assert page.explorer.prediction.miss < 1e-6
    assert page.sliders()["wait"] == pytest.approx(page.explorer.cast.wait, abs=5e-4)
    assert not page.explorer.poll()
    planned = page.explorer.cast
    page.move(wait=0.2)
    assert page.explorer.cast == Cast(planned.distance, planned.speed, 0.2, planned.bearing)


def test_a_cup_out_of_reach_is_named_with_the_nearest_position(page):
    cast = page.explorer.cast
    page.move(cup_distance=1.15, cup_bearing=0.0)
    page.press(PLAN)
    assert page.explorer.cast == cast
    assert "out of reach" in page.caption
    assert "the nearest is 0.988,0.0" in page.caption
    page.move(cup_distance=0.7)
    assert "out of reach" not in page.caption


def test_a_plan_that_cannot_hit_says_so(page, monkeypatch):
    def plan(model, cup):
        return replace(plan_cast(model, cup), is_feasible=False, reason="tired")

    monkeypatch.setattr(explorer_module, "plan_cast", plan)
    page.press(PLAN)
    assert "No cast is predicted to end in the cup: tired" in page.caption


def test_without_a_model_the_page_says_how_to_get_one_and_goes_on(page_without_model):
    page = page_without_model
    page.move(wait=0.3)
    assert page.explorer.prediction is None
    assert not page.is_visible("predicted")
    assert not page.meshcat.HasPath("/explorer/reach")
    assert "has no model: go and &lt;fit&gt; it" in page.caption
    cast = page.explorer.cast
    page.press(PLAN)
    assert page.explorer.cast == cast
    assert "No plan without a model: see below" in page.caption
    page.press(FETCH)
    assert "No ball has landed yet" in page.caption


def test_limits_that_the_arm_will_meet_are_predicted(page, monkeypatch):
    of = Prediction.of
    for load, speed, expected in ((0.9, 0.9, False), (1.1, 0.9, True), (0.9, 1.1, True)):
        monkeypatch.setattr(
            Prediction,
            "of",
            lambda *args, p=load, v=speed: of(*args)._replace(peak_torque_utilization=p, peak_velocity_utilization=v),
        )
        page.explorer.choose(page.explorer.cast)
        assert ("predicted to meet its limits" in page.caption) is expected


def test_a_press_is_answered_for_the_sliders_as_they_were_moved_before_it(page, monkeypatch):
    executed = []
    monkeypatch.setitem(page.explorer._actions, CAST, lambda: executed.append(page.explorer.cast.wait))
    page.meshcat.SetSliderValue("wait [s]", 0.4)
    page.press(CAST)
    assert executed == [pytest.approx(0.4)]


class EndError(Exception):
    pass


def test_it_follows_its_page_by_itself_and_rests_in_between(page, monkeypatch):
    rests = iter([0.3, 0.45])

    def rest(seconds):
        assert seconds > 0.01
        page.meshcat.SetSliderValue("wait [s]", next(rests, None) or end())

    def end():
        raise EndError

    async def rest_in_loop(seconds):
        rest(seconds)

    monkeypatch.setattr(explorer_module.time, "sleep", rest)
    monkeypatch.setattr(explorer_module.asyncio, "sleep", rest_in_loop)
    with pytest.raises(EndError):
        page.explorer.run()
    assert page.explorer.cast.wait == pytest.approx(0.45)
    rests = iter([0.2])
    with pytest.raises(EndError):
        page.explorer.follow().send(None)
    assert page.explorer.cast.wait == pytest.approx(0.2)


@pytest.mark.slow
def test_a_cast_is_executed_marked_and_drawn_by_stage(page):
    page.press(CAST)
    explorer = page.explorer
    expected = simulate_cast(explorer.scenario, explorer.cast, explorer.cup)
    np.testing.assert_allclose(explorer.outcome.landing, expected.landing, atol=1e-9)
    assert explorer.outcome.status is expected.status
    assert page.is_visible("executed")
    np.testing.assert_allclose(page.position("/explorer/executed"), expected.landing, atol=1e-9)
    for stage in ("move", "wait", "drop"):
        assert page.meshcat.HasPath(f"/explorer/path/{stage}")
    assert f"miss {1e3 * expected.miss:.1f} mm" in page.caption
    bodies = {"/drake/visualizer/ball/ball", "/drake/visualizer/wam7/tool_plate"}
    assert bodies | {"/explorer/path/drop"} <= page.replayed()
    page.move(wait=0.3)
    assert not page.replayed()  # it would move the bodies away again
    assert f"Last cast: {expected.status.value.replace('_', ' ')}" in page.caption
    assert page.is_visible("executed")


@pytest.mark.slow
def test_with_the_cup_moved_to_the_ball_the_same_cast_is_caught_without_a_model_too(page_without_model):
    page = page_without_model
    page.explorer.choose(Cast(0.3, 0.6, 0.1), (0.5, 0.5))
    page.press(CAST)
    assert not page.explorer.outcome.is_caught
    landing = page.explorer.outcome.landing
    page.press(FETCH)
    np.testing.assert_allclose(page.explorer.cup, landing)
    page.press(CAST)
    assert page.explorer.outcome.is_caught
    assert "Caught, miss 0.0 mm" in page.caption


@pytest.mark.slow
def test_a_cast_that_never_lands_is_told_and_the_next_one_works():
    # A hand that drops by so little leaves the ball above the rim; a scenario that is read is refused for it.
    shallow = Motion(drop_distance=0.01, hold_duration=0.1)
    page = Page(Scenario().model_copy(update={"motion": shallow}))
    page.press(CAST)
    assert page.explorer.outcome.status is Status.NEVER_CROSSED
    assert "Never crossed" in page.caption
    assert not page.is_visible("executed")
    assert page.meshcat.HasPath("/explorer/path/move")
    page.press(FETCH)
    assert "No ball has landed yet" in page.caption
    page.press(CAST)
    assert "Never crossed" in page.caption


@pytest.mark.slow
def test_noise_is_another_in_each_cast():
    page = Page(Scenario.from_dict({"noise": {"speed": 0.02}}))
    landings = []
    for _ in range(2):
        page.press(CAST)
        landings.append(page.explorer.outcome.landing)
    assert math.dist(*landings) > 1e-4


def check_refused_in_a_thread(call):
    refused = pytest.raises(
        InputError, match=r"^Explorer, called in the thread 'mine_0': .* make it and call it there$"
    )
    with ThreadPoolExecutor(1, "mine") as pool, refused:
        pool.submit(call).result()


def test_explorer_is_not_made_in_a_thread_where_its_end_would_end_the_process():
    check_refused_in_a_thread(Explorer)


def test_explorer_of_another_thread_is_refused_before_anything_changes(page):
    explorer = page.explorer
    before = explorer.cast, explorer.cup, page.caption, explorer.outcome
    page.meshcat.SetSliderValue("distance [m]", 0.2)
    another = partial(explorer.choose, Cast(0.2, 0.5, 0.1))
    for call in (explorer.run, explorer.execute, explorer.plan, explorer.move_cup_to_ball, another):
        check_refused_in_a_thread(call)
    assert (explorer.cast, explorer.cup, page.caption, explorer.outcome) == before
    assert explorer.poll()
    assert explorer.cast.distance == pytest.approx(0.2)
    assert explorer.plan() is not None
