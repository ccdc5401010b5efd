"""What was built and used is freed when nobody wants it any more, where Drake lets it."""

import gc
import weakref

import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from wam_cast.cast import Cast
from wam_cast.perception.recorded_cast import CastWatcher
from wam_cast.robot.controller import CastController
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.visualization.scene import CastScene

CAST, CUP = Cast(0.3, 0.6, 0.1), (0.6, 0.0)


class Bare(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("nothing", 1, lambda context, output: None)


def station():
    station = CastStation(Scenario())
    return station.diagram, station.plant, station.controller


def noisy_station():
    noise = {"torque": 0.01, "encoder_counts": 4096, "swing": 0.01}
    station = CastStation(Scenario(noise=noise, controller={"delay": 1}))
    return station.diagram, station.plant, station.controller


def evaluated_controller():
    controller = CastController(Scenario())
    context = controller.CreateDefaultContext()
    controller.GetInputPort("arm_state").FixValue(context, [0.1] * 14)
    controller.GetOutputPort("actuation").Eval(context)
    return controller, context


def started_station():
    station = CastStation(Scenario(), has_scene=False)
    simulator = Simulator(station.diagram)
    station.set_start(simulator.get_mutable_context(), CAST)
    simulator.AdvanceTo(0.01)
    return station.diagram, simulator, simulator.get_context()


def station_in_a_diagram():
    station = CastStation(Scenario(), has_scene=False)
    builder = DiagramBuilder()
    builder.AddSystem(station.diagram)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    station.set_start(context, CAST)
    return diagram, station.diagram, context


def used_simulator():
    simulator = CastSimulator(Scenario())
    assert simulator.simulate(CAST, CUP).status
    loops = simulator._contact_free._loop, simulator._contact._loop
    return (simulator, *(loop._simulator for loop in loops), *(loop._simulator.get_context() for loop in loops))


def scene():
    scene = CastScene(Scenario(), CUP)
    return scene.plant, scene._diagram, scene._context


def watcher():
    watcher = CastWatcher(Scenario(cameras={"number": 2}))
    eyes = watcher._eyes
    return watcher, watcher._diagram, eyes.observer, *eyes.sensors, *eyes.shutters, *eyes.detectors


def kept(make):
    """Return the names of the classes of what `make` returns that are still there when it is let go of."""
    references = [weakref.ref(thing) for thing in make()]
    gc.collect()
    return [type(thing).__name__ for reference in references if (thing := reference()) is not None]


@pytest.fixture(scope="module", autouse=True)
def _drake_that_frees():
    if kept(lambda: (Bare(),)):
        pytest.skip("this Drake keeps every Python class that declares a port")


@pytest.mark.parametrize(
    "make",
    [
        evaluated_controller,
        station,
        noisy_station,
        started_station,
        station_in_a_diagram,
        used_simulator,
        scene,
        watcher,
    ],
)
def test_it_is_freed(make):
    assert kept(make) == []
