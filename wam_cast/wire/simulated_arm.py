"""SimulatedArm: a simulated arm, with its string, ball and cup, that a controller on the other side of a wire casts with."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.robot.station import CastStation, believed
from wam_cast.scenario import Scenario
from wam_cast.simulation.loop_stability import MAX_GROWTH, check_loop, loop_growth
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Position
from wam_cast.wire.arm_port import ArmStoppedError, LockStepPort, RealTimePort, RemoteLaw
from wam_cast.wire.arm_service import ArmService, OnOutcome
from wam_cast.wire.bus import Bus, Clock, WallClock
from wam_cast.wire.one_pass import OnePass
from wam_cast.wire.safety import ArmLimits, ArmSafety, Refusal
from wam_cast.wire.stage import stopped_outcome

MOST_DELAY = 20
"""Periods, beyond which nobody looks."""


def stable_delay(robot: Scenario, belief: Scenario) -> int:
    """Return how many periods, beyond those of `controller.delay`, commands may be late with the control loop still stable.

    Raises `.InputError` if it is unstable as it is.
    """
    check_loop(robot, belief)
    delay = robot.controller.delay
    while delay < MOST_DELAY:
        later = robot.controller.model_copy(update={"delay": delay + 1})
        if loop_growth(robot.model_copy(update={"controller": later}), belief) > MAX_GROWTH:
            break
        delay += 1
    return delay - robot.controller.delay


class SimulatedArm(ArmService):
    """Simulates the casts that are asked for, with the torques that come over a wire.

    Parameters
    ----------
    bus, clock
        Over which it is asked; what time it keeps, by default the machine's.
    scenario, belief
        What is simulated, and what its controller takes it for, as in `.CastSimulator`: of that it knows where a cast starts.
    is_real_time
        Whether its clock runs by itself, at one sample a control period, or waits for each command.
    on_refusal
        Called with each command that is refused.
    on_outcome
        Called with each cast that was asked for, its outcome, and what was counted meanwhile: `refused` commands by their kind; in
        real time the `n_ticks`, how many were `n_missed`, and by how much at most, `worst_lateness` [s].

    Attributes
    ----------
    safety, port
        What decides about commands, and where they come in.
    one_pass
        In real time, what simulates a cast.

    Raises
    ------
    InputError
        As `.CastSimulator` does, and in real time if the control loop is unstable a period later, when a command acts there.
    """

    def __init__(
        self,
        bus: Bus,
        scenario: Scenario,
        belief: Scenario | None = None,
        *,
        clock: Clock | None = None,
        is_real_time: bool = False,
        on_refusal: Callable[[Refusal], None] = lambda _: None,
        on_outcome: OnOutcome = lambda *_: None,
    ) -> None:
        period = scenario.controller.period
        super().__init__(bus, period, is_real_time=is_real_time, on_outcome=on_outcome)
        law_belief = believed(scenario, belief)
        max_delay = stable_delay(scenario, law_belief)
        if is_real_time and max_delay < 1:
            raise InputError(
                f"controller.delay = {scenario.controller.delay}: in real time a command acts a period later besides, with which "
                "the control loop is unstable; choose a lower delay, a shorter period or lower gains, or lock step"
            )
        arm = CastStation(scenario, has_scene=False, has_ball=False)
        self.safety = ArmSafety(ArmLimits.of(arm.plant, arm.motors), period, max_delay)
        self._q_start = starting_posture(law_belief)
        make_port = RealTimePort if is_real_time else LockStepPort
        self.port = make_port(bus, WallClock() if clock is None else clock, self.safety, period, on_refusal)
        if isinstance(self.port, RealTimePort):
            station = CastStation(scenario, belief=belief, controller=RemoteLaw(law_belief, self.port))
            self.one_pass = OnePass(station, partial(self.port.open, self._q_start))
        else:
            self._simulator = CastSimulator(scenario, belief, make_controller=partial(RemoteLaw, port=self.port))

    def make(self, cast: Cast, cup: Position | None, noise_seed: int) -> tuple[Outcome, dict[str, Any]]:
        """Simulate a cast, and return its outcome and what was counted meanwhile."""
        try:
            if isinstance(self.port, RealTimePort):
                outcome = self.one_pass.simulate(cast, cup, noise_seed)
            else:
                self.port.open(self._q_start)
                outcome = self._simulator.simulate(cast, cup, noise_seed=noise_seed)
        except ArmStoppedError:
            outcome = stopped_outcome(self.safety.stop_reason, self.port.time)
        finally:
            self.port.close()
        return outcome, self.port.counted()
