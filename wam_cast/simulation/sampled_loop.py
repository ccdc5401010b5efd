"""SampledLoop: a station's plant alone under Drake's integrator, and what its blocks do with each sample done here in Python.

What a diagram costs besides is half a cast's time: events, ports and caches at each sample, and the calls between C++ and Python.
The numbers are the diagram's, bit for bit, since both call the same methods of the blocks.
"""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder

from wam_cast.motion.stages import CastMotion
from wam_cast.robot.controller import ArmController, Desired, MeasuredArm
from wam_cast.robot.drake_types import add_system
from wam_cast.robot.forces import add_plant
from wam_cast.robot.motors import delay_line, pass_through
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.station import CastStation, Log
from wam_cast.robot.station_state import StationState
from wam_cast.simulation.station_loop import StationLoop
from wam_cast.types import Array, Position


def make_loop(station: CastStation, method: str, max_step: float, accuracy: float) -> StationLoop:
    """Return the faster loop of those that can simulate `station`."""
    controller = station.controller
    is_law = isinstance(controller, ArmController) and controller.is_law
    return (SampledLoop if is_law else StationLoop)(station, method, max_step, accuracy)


class SampledLoop(StationLoop):
    """Simulates a station whose controller is an `.ArmController` of which `torque` and `hand_desired` are the whole.

    Control period by control period the blocks' methods turn the arm's state into the torque that is held, and the plant goes on.
    A motion begins in a context of the station's diagram, which also takes the state when somebody asks for it.
    """

    def _plant_and_simulator(self) -> tuple[MultibodyPlant, Simulator]:
        station, builder = self.station, DiagramBuilder()
        has_scene, has_ball = station.scene_graph is not None, station.ball_tracker is not None
        plant, _ = add_plant(builder, station.scenario, has_scene=has_scene, has_ball=has_ball)
        # A boundary of time alone, without a sample there, ends the integrator's steps a little differently.
        hold = add_system(builder, "hold", delay_line(1, self._period))
        builder.Connect(hold.get_output_port(), plant.get_actuation_input_port())
        builder.ExportInput(hold.get_input_port())
        n_q = plant.num_positions()
        self._of_arm = np.r_[0:N_ARM, n_q : n_q + N_ARM]
        self._station_context = station.diagram.CreateDefaultContext()
        assert isinstance(station.controller, ArmController)
        self._controller = station.controller
        self._arm = MeasuredArm(station.controller.plant)
        return plant, Simulator(builder.Build())

    def _begin(
        self,
        context: Context,
        motion: CastMotion,
        cup: Position | None,
        noise_seed: int,
        state: StationState | None,
        time: float,
    ) -> None:
        station, own = self.station, self._station_context
        super()._begin(own, motion, cup, noise_seed, state, time)
        context.SetTime(time)
        self.plant_context.SetStateAndParametersFrom(station.plant.GetMyContextFromRoot(own))
        self._motion = self._controller.motion(self._controller.GetMyContextFromRoot(own))
        self._noise_seed, self._n = noise_seed, round(time / self._period)
        self._held, self._waiting = (
            np.zeros(0) if line is None else line.GetMyContextFromRoot(own).get_discrete_state_vector().CopyToVector()
            for line in (station.hold, station.delay)
        )
        self._times, self._states, self._torques = [time], [self._x()], [self._held]

    def _advance(self, n: int) -> None:
        given, context = self._simulator.get_system().get_input_port(), self._simulator.get_mutable_context()
        while self._n < n:
            self._sample(self._states[-1][self._of_arm])
            given.FixValue(context, self._held)
            self._simulator.AdvanceTo((self._n + 1) * self._period, interruptible=False)
            self._n += 1
            self._times.append(self._n * self._period)
            self._states.append(self._x())
            self._torques.append(self._held)

    def _sample(self, arm_state: Array) -> None:
        """Take in the arm's state (14,), and hold what the motors give then: what the station's blocks do at a sample."""
        station, time = self.station, self._n * self._period
        self._arm.measure(arm_state if station.encoders is None else station.encoders.measured(arm_state))
        torque = self._commanded(self._arm, time)
        if station.delay is not None:
            torque, self._waiting = pass_through(station.delay, self._waiting, torque)
        if station.torque_noise is not None:
            torque = station.torque_noise.added_to(torque, time, self._noise_seed)
        self._held = station.motors.given(torque, arm_state)

    def _commanded(self, arm: MeasuredArm, time: float) -> Array:
        """Return the torque [N m], (7,), that the motors are to give, of a measured arm at a `time` [s]: the controller's."""
        desired = Desired(*self._controller.hand_desired(time, self._motion), time, self._motion)
        return self._controller.torque(arm, desired)

    def _x(self) -> Array:
        x: Array = self.plant_context.get_continuous_state_vector().CopyToVector()
        return x

    def state(self) -> StationState:
        """Return a copy of the time and the state."""
        station, own = self.station, self._station_context
        own.SetTime(self._simulator.get_context().get_time())
        station.plant.GetMyMutableContextFromRoot(own).SetStateAndParametersFrom(self.plant_context)
        for line, torques in ((station.hold, self._held), (station.delay, self._waiting)):
            if line is not None:
                line.GetMyMutableContextFromRoot(own).SetDiscreteState(torques)
        return station.state(own)

    def log(self) -> Log:
        """Return the samples since `begin`, the first one there included."""
        return Log(np.array(self._times), np.array(self._states), np.array(self._torques))
