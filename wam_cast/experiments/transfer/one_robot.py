"""One unknown robot: practice, plans after some practice, what becomes of them, and a campaign at one cup."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.methods import AdaptationMethod
from wam_cast.adaptation.robot import Observation, SimulatedRobot
from wam_cast.cast import Cast
from wam_cast.casting_plane import from_casting_plane, from_polar, to_casting_plane
from wam_cast.experiments.frames import Record, Result, Rows
from wam_cast.experiments.transfer.transfer_settings import BEST, CUPS, MAIN_KS, TransferSettings
from wam_cast.experiments.trials import Polar, draw_cups
from wam_cast.motion.in_flight import InFlight
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.planning.plan import Plan, plan_cast
from wam_cast.planning.prediction import ACROSS, ALONG
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import CastSimulator, simulate_cast
from wam_cast.types import Array

STREAK = 10
"""Catches in a row that end a campaign."""


class RobotStudy(Result):
    """What was found of one robot.

    Attributes
    ----------
    plans
        A row a plan.

        ::

            method, k, cup              after k practice casts
            radius                      of the cup about the base axis, on the line y = 0 [m]
            distance, speed, wait, cast_bearing     the cast
            is_feasible                 of the plan
            error_along, error_across   where the cast lands without noise, from where it was predicted, in the casting plane [m]
            std_along, std_across       the prediction's standard deviations, noise aside [m]
            bias                        distance of that landing from the cup's axis [m]
            status: and the cup's name  what becomes of the cast with noise in that cup, None where it was not tried
            miss                        with noise, in the first cup [m], nan where it was not tried
    first_catch, streak_end
        Casts of the campaign up to its first catch, and up to the end of the first ten in a row; None if it did not come to that.
    n_casts
        Of the campaign.
    """

    plans: Rows
    first_catch: int | None
    streak_end: int | None
    n_casts: int


@dataclass(frozen=True)
class UnknownRobot:
    """A robot, and what is known of it: the models before the first cast, by method, and the casts to practise."""

    settings: TransferSettings
    truth: Scenario
    number: int
    models: Mapping[AdaptationMethod, AdaptiveModel]
    practice: Sequence[Cast]

    def study(self) -> RobotStudy:
        """Let it practise, plan, and cast."""
        planned = list(self._planned(self._practise()))
        landings = self._landings([plan.cast for _, _, _, plan, _ in planned])
        tries = self._tries([of_plan[:4] for of_plan in planned])
        rows = [
            self._row(*of_plan, landing) | tried
            for of_plan, landing, tried in zip(planned, landings, tries, strict=True)
        ]
        first, end, n_casts = self._campaign()
        return RobotStudy(plans=pd.DataFrame(rows), first_catch=first, streak_end=end, n_casts=n_casts)

    def _planned(self, seen: Sequence[Observation]) -> Iterator[tuple[AdaptationMethod, int, int, Plan, AdaptiveModel]]:
        """Yield each method's plans after so many practice casts for so many cups, with the model that they come from."""
        for method, before in self.models.items():
            for k in (0,) if method == "nominal" else self.settings.ks:
                model = before.learn(seen[:k])
                for cup in range(self._n_cups(method, k)):
                    yield method, k, cup, plan_cast(model, from_polar(*self._cups[cup])), model

    def _n_cups(self, method: AdaptationMethod, k: int) -> int:
        is_tried_on_all = method == "nominal" or (method == BEST and k in MAIN_KS)
        return self.settings.n_cups if is_tried_on_all else self.settings.n_compared_cups

    @cached_property
    def _cups(self) -> list[Polar]:
        seed = derived_seed(self.settings.seed, Purpose.CUPS, self.number)
        return draw_cups(common_reach(self.models.values()), self.settings.n_cups, seed)

    def _robot(self, seed: int) -> SimulatedRobot:
        return SimulatedRobot(self.truth, self.settings.scenario, seed=seed)

    def _practise(self) -> list[Observation]:
        robot = self._robot(derived_seed(self.settings.seed, Purpose.NOISE, 2 * self.number))
        return [robot.cast(cast) for cast in self.practice]

    def _landings(self, casts: Sequence[Cast]) -> Array:
        """Return where casts land without noise, world (x, y) [m], shape (n, 2)."""
        clean, belief = self.truth.without_noise, self.settings.scenario
        if self.settings.engine == "batch":
            from wam_cast.batch.engine import simulate_batch

            frame = simulate_batch(clean, casts, belief=belief)
            pairs = zip(frame["landing_along"], frame["landing_across"], casts, strict=True)
            return np.array([from_casting_plane(along, across, cast.bearing) for along, across, cast in pairs])
        return np.array([simulate_cast(clean, cast, belief=belief).landing for cast in casts])

    def _row(self, method: str, k: int, cup: int, plan: Plan, model: AdaptiveModel, landing: Array) -> Record:
        radius, bearing = self._cups[cup]
        error = to_casting_plane(landing - plan.predicted_landing, plan.cast.bearing)
        std = model.toward(bearing).predict_std(plan.cast.to_array()[np.newaxis, :3])[0]
        return {
            "method": method,
            "k": k,
            "cup": cup,
            "radius": radius,
            "distance": plan.cast.distance,
            "speed": plan.cast.speed,
            "wait": plan.cast.wait,
            "cast_bearing": plan.cast.bearing,
            "is_feasible": plan.is_feasible,
            "error_along": error[0],
            "error_across": error[1],
            "std_along": std[ALONG],
            "std_across": std[ACROSS],
            "bias": float(np.linalg.norm(landing - plan.cup)),
        }

    def _tries(self, planned: Sequence[tuple[AdaptationMethod, int, int, Plan]]) -> Iterator[Record]:
        """Yield what becomes of casts with noise in each cup; all of a cup have the same noise.

        The batched engine brings them near the cup, if there is to be one; from there on it is Drake that simulates them.
        """
        belief, casts = self.settings.scenario, [plan.cast for *_, plan in planned]
        seeds = [
            derived_seed(self.settings.seed, Purpose.NOISE, 1_000_003 + 1000 * self.number + cup)
            for _, _, cup, _ in planned
        ]
        on_the_way: list[InFlight | None] = [None] * len(casts)
        if self.settings.engine == "batch":
            from wam_cast.batch.mid_flight import states_before_landing

            on_the_way = states_before_landing(self.truth, casts, seeds, belief=belief)
        simulators = {name: CastSimulator(_with_cup(self.truth, values), belief) for name, values in CUPS.items()}
        first = next(iter(CUPS))
        for (method, k, _, plan), seed, since in zip(planned, seeds, on_the_way, strict=True):
            tried = CUPS if method == BEST and k in MAIN_KS and k > 0 else (first,)
            outcomes = {name: _outcome(simulators[name], plan, since, seed) for name in tried}
            statuses = {f"status: {name}": str(outcomes[name].status) if name in outcomes else None for name in CUPS}
            yield {"miss": outcomes[first].miss} | statuses

    def _campaign(self) -> tuple[int | None, int | None, int]:
        """Cast at one cup and learn from each cast, until ten catches in a row."""
        robot = self._robot(derived_seed(self.settings.seed, Purpose.NOISE, 2 * self.number + 1))
        model, cup = self.models[BEST], from_polar(*self._cups[0])
        first, in_a_row = None, 0
        for number in range(1, self.settings.longest_campaign + 1):
            seen = robot.cast(plan_cast(model, cup).cast, cup)
            in_a_row = in_a_row + 1 if seen.is_caught else 0
            if seen.is_caught and first is None:
                first = number
            if in_a_row == STREAK:
                return first, number, number
            model = model.learn([seen])
        return first, None, self.settings.longest_campaign


def common_reach(models: Iterable[AdaptiveModel]) -> Reach:
    """Return the region that all of the models reach."""
    regions = [Reach.of(model) for model in models]
    nearest, farthest = max(one.nearest for one in regions), min(one.farthest for one in regions)
    return replace(regions[0], nearest=nearest, farthest=farthest)


def _outcome(simulator: CastSimulator, plan: Plan, since: InFlight | None, noise_seed: int) -> Outcome:
    """Return what becomes of a plan's cast, from a state that it was brought to if there is one."""
    if since is None:
        return simulator.simulate(plan.cast, plan.cup, noise_seed=noise_seed)
    return simulator.simulate_on(plan.cast, plan.cup, since, noise_seed=noise_seed)


def _with_cup(truth: Scenario, values: Mapping[str, float]) -> Scenario:
    return truth.model_copy(update={"cup": truth.cup.model_copy(update=dict(values))})
