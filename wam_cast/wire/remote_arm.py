"""RemoteArm: the controller's side: it has an arm on the other side of a wire cast, and says what became of the ball."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import DiagramBuilder

from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast, checked_cup
from wam_cast.casting_plane import to_casting_plane
from wam_cast.errors import InputError, MachineError, checked_integer
from wam_cast.motion.noise_draws import executed_cast
from wam_cast.robot.controller import CastController
from wam_cast.robot.drake_types import add_system, evaluate
from wam_cast.robot.motors import Motors
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.types import Array, Position, checks_types
from wam_cast.wire.bus import DEFAULT_URL, Bus, Clock, LcmBus, WallClock
from wam_cast.wire.messages import (
    COMMAND_CHANNEL,
    MICROSECONDS,
    STATUS_CHANNEL,
    ArmStatus,
    Command,
    ControlMode,
    MessageError,
    RobotMode,
    command_message,
    decode_status,
)
from wam_cast.wire.stage import REPLY_CHANNEL, REQUEST_CHANNEL, StageReply, StageRequest, outcome_of
from wam_cast.wire.systems import CommandSender, StatusReceiver

ASK_AGAIN = 0.2
"""After which a question is asked again [s]."""

ANSWER_PATIENCE = 5.0
"""Without a word from the arm, after which it is given up [s]."""

BUSY_PATIENCE = 10.0
"""For which an arm may be busy with another's cast [s], such as one whose controller is gone."""

APART = 0.02
"""How long the arm gets to take in one command before it is told to stay [s]: on LCM's bus the next would be lost until then."""

AT_START = 0.01
"""How far a joint may be from where the scenario starts a cast [rad]: less than a centimetre at the hand. It is what the arm's side
allows between a target and where the arm is, and a quarter of what has a motor saturate."""


class CommandLaw:
    """A controller that answers statuses with commands: a diagram of receiver, control law and sender.

    It is a pure function of a status and the cast. The law's clock is the time of the motion that the status says.

    Parameters
    ----------
    scenario
        The robot as it is believed to be.
    """

    def __init__(self, scenario: Scenario) -> None:
        builder = DiagramBuilder()
        receiver = add_system(builder, "receiver", StatusReceiver())
        self._law = add_system(builder, "controller", CastController(scenario))
        limits = Motors(self._law.plant, scenario.arm).limits
        self._sender = add_system(builder, "sender", CommandSender(limits))
        status = builder.ExportInput(receiver.GetInputPort("status"), "status")
        builder.ConnectInput(status, self._sender.GetInputPort("status"))
        builder.Connect(receiver.GetOutputPort("arm_state"), self._law.GetInputPort("arm_state"))
        builder.Connect(self._law.GetOutputPort("actuation"), self._sender.GetInputPort("torque"))
        builder.ExportOutput(self._sender.GetOutputPort("command"), "command")
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._period = scenario.controller.period

    def set_cast(self, cast: Cast, cup: Position | None) -> None:
        """Set what is to be cast, and where the cup is."""
        radius = None if cup is None else to_casting_plane(np.array(cup), cast.bearing)[0]
        self._law.set_cast(self._law.GetMyMutableContextFromRoot(self._context), cast, cup_radius=radius)

    def command(self, status: lcmt_panda_status) -> lcmt_panda_command:
        """Return the command that answers a status."""
        # The time of a sample as one process counts it, to the last bit.
        n = round(status.robot_utime / MICROSECONDS / self._period)
        self._context.SetTime(n * self._period)
        self._diagram.GetInputPort("status").FixValue(self._context, AbstractValue.Make(status))
        command: lcmt_panda_command = evaluate(self._diagram.GetOutputPort("command"), self._context)
        return command


class RemoteArm:
    """Has an arm on the other side of a wire cast, as `wc.simulate_cast` has a simulated one in this process.

    Parameters
    ----------
    scenario
        The robot as it is believed to be: what is controlled with, and whose noise of the executed cast is drawn.
    bus, clock
        Over which it is asked, by default LCM's on `DEFAULT_URL`; and what time is kept.

    Attributes
    ----------
    service
        What the arm's side counted in the last cast: see `.SimulatedArm`; empty before.
    """

    @checks_types
    def __init__(self, scenario: Scenario, bus: Bus | None = None, *, clock: Clock | None = None) -> None:
        self._scenario = scenario
        self._bus: Bus = LcmBus(DEFAULT_URL) if bus is None else bus
        self._clock = WallClock() if clock is None else clock
        self._law = CommandLaw(scenario)
        self._q_start = starting_posture(scenario)
        self._question: StageRequest | None = None
        self._reply: StageReply | None = None
        self._is_accepted = False
        self._status: ArmStatus | None = None
        self._unanswered: tuple[int, ...] = ()
        self._asked_at = self._heard_at = 0.0
        self._flaw = self._objection = ""
        self.service: dict[str, Any] = {}
        self._bus.subscribe(STATUS_CHANNEL, self._hear_status, newest_only=True)
        self._bus.subscribe(REPLY_CHANNEL, self._hear_reply)

    @checks_types
    def cast(self, cast: Cast, cup: Position | None = None, *, noise_seed: int = 0) -> Outcome:
        """Have the arm make `cast`, from rest at home, into a cup at world (x, y) [m], and return what became of it.

        Raises
        ------
        InputError
            If the arm cannot make it, has another control period, or waits elsewhere than where the scenario starts a cast.
        MachineError
            If nobody answers, the arm is busy with another's cast, or its side falls silent or speaks as another version.
        """
        cup = None if cup is None else checked_cup(cup)
        seed = checked_integer("noise_seed", noise_seed, 0)
        there = self._greet()
        self._law.set_cast(executed_cast(self._scenario.noise, cast, seed), cup)
        try:
            reply = self._ask(StageRequest(uuid4().hex, there.robot, cast, cup, seed))
        except BaseException:  # Ctrl-C most of all: no arm is to wait for the watchdog
            self._have_it_stay()
            raise
        finally:
            self._question = None
        if reply.state == "refused":
            raise InputError(f"the arm at {self._bus.url} refuses the cast: {reply.detail}")
        self.service = reply.service or {}
        try:
            return outcome_of(reply.outcome or {})
        except MessageError as error:
            raise MachineError(self._other_version(error)) from None

    def _greet(self) -> StageReply:
        """Return what the arm's side says of itself when it is free."""
        reply = self._ask(StageRequest(uuid4().hex))
        period = self._scenario.controller.period
        if reply.period != period:
            raise InputError(
                f"controller.period = {period:g} s, and the arm at {self._bus.url} is sampled every {reply.period:g} s; "
                "give both sides the same scenario"
            )
        return reply

    def _ask(self, request: StageRequest) -> StageReply:
        """Ask until the answer is final; meanwhile, once the arm has accepted it, its statuses are answered."""
        begun = self._clock.now()
        self._forget_all_before(request, begun)
        while True:
            self._ask_again()
            self._bus.handle(ASK_AGAIN)
            if self._objection:
                raise InputError(self._objection)
            reply = self._reply
            if reply is not None and reply.state in ("ready", "done", "refused"):
                return reply
            if reply is not None and reply.state == "busy" and self._clock.now() - begun > BUSY_PATIENCE:
                raise MachineError(f"the arm at {self._bus.url} is busy with another's cast; try again later")
            if self._clock.now() - self._heard_at > ANSWER_PATIENCE:
                raise MachineError(self._silence(request))

    def _forget_all_before(self, request: StageRequest, now: float) -> None:
        """Begin anew with a question, to be asked at once."""
        self._question, self._reply, self._is_accepted = request, None, False
        self._status, self._unanswered = None, ()
        self._flaw = self._objection = ""
        self._asked_at, self._heard_at = now - ASK_AGAIN, now

    def _ask_again(self) -> None:
        """Ask what is asked, unless it was just now."""
        if self._question is not None and self._clock.now() - self._asked_at >= ASK_AGAIN:
            self._asked_at = self._clock.now()
            self._bus.publish(REQUEST_CHANNEL, self._question.encode())

    def _silence(self, request: StageRequest) -> str:
        if self._flaw:
            return self._other_version(self._flaw)
        if request.cast is None:
            return (
                f"nobody answers at {self._bus.url} within {ANSWER_PATIENCE:g} s; start an arm with `wam-cast robot`, with "
                "the same --url, on this machine or, with ttl=1 in the address, in this network"
            )
        return f"the arm at {self._bus.url} fell silent amid the cast, for {ANSWER_PATIENCE:g} s; look at its side, and cast again"

    def _other_version(self, flaw: object) -> str:
        return f"the arm at {self._bus.url} answers with {flaw}; run the same version on both sides"

    def _hear_reply(self, data: bytes) -> None:
        """Note an answer to the question that is asked; what is none counts only if no other comes."""
        try:
            reply = StageReply.decode(data)
        except MessageError as error:
            self._flaw = str(error)
            return
        question = self._question
        if question is None or reply.number != question.number:
            return
        is_of_asked = reply.robot == question.robot
        if self._is_accepted and (not is_of_asked or reply.state == "busy"):  # another arm's, or one that was overtaken
            return
        self._is_accepted = self._is_accepted or (is_of_asked and reply.state == "casting")
        self._reply, self._heard_at = reply, self._clock.now()

    def _hear_status(self, data: bytes) -> None:
        """Answer a status, if it is of the cast that was asked for here, and the arm waits for that."""
        try:
            status = decode_status(data)
        except MessageError:
            return
        if not self._is_accepted:  # it may be of another's cast, or else the arm's answer was lost
            self._ask_again()
            return
        self._heard_at = self._clock.now()
        if self._question is None or status.robot_mode is RobotMode.REFLEX:
            return
        if status.control_mode is ControlMode.LOCKED:
            self._objection = self._objection_to(status.q)
        if self._objection:
            return
        self._status, self._unanswered = status, (status.utime,)
        command = self._law.command(lcmt_panda_status.decode(data)).encode()
        self._unanswered = status.utime, status.utime + 1  # interrupted while it is sent, nobody knows which
        self._bus.publish(COMMAND_CHANNEL, command)
        self._unanswered = (status.utime + 1,)

    def _objection_to(self, q: Array) -> str:
        """Return why no cast can begin with an arm at `q` [rad], (7,), or nothing."""
        off = np.abs(q - self._q_start)
        if off.max() <= AT_START:
            return ""
        i = int(off.argmax())
        return (
            f"joint {i + 1} of the arm at {self._bus.url} is at {q[i]:.4g} rad, and the scenario starts a cast at "
            f"{self._q_start[i]:.4g} rad; bring it there, to {AT_START:g} rad, or name the same scenario on both sides (what a "
            "simulated arm is taken for is the `--belief` of `wam-cast robot`)"
        )

    def _have_it_stay(self) -> None:
        """Tell the arm to stay where it is, in answer to its last status, or if that is answered to the one after it."""
        self._question = None
        for utime in self._unanswered:
            assert self._status is not None
            self._clock.sleep_until(self._clock.now() + APART)
            stay = Command(utime, ControlMode.POSITION, position=self._status.q)
            self._bus.publish(COMMAND_CHANNEL, command_message(stay).encode())
