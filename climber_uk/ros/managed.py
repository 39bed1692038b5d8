"""A managed node: configured and activated by itself, or by whoever manages the others."""

from lifecycle_msgs.srv import ChangeState
from rclpy._rclpy_pybind11 import RCLError
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.subscription import Subscription
from std_srvs.srv import SetBool

from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.ros.running import ClimberNode

ACTIVE, INACTIVE = "active", "inactive"


@parameters
class Life:
    """How a managed node starts."""

    autostart: bool = parameter(True, "", "become active at the start, without a manager")


class ManagedNode(LifecycleNodeMixin, ClimberNode):
    """Unconfigured it hears nothing; what it does inactive and active is told to `act`.

    `~/enable` does what activating and deactivating do.
    """

    def __init__(self, name: str) -> None:
        ClimberNode.__init__(self, name)
        self.parameters.declare(Life)
        self.inputs: list[Subscription] = []
        self.failure = ""  # why it could not be configured

    def start_life(self) -> None:
        """Offer the services of a managed node, and become active unless another is to say so.

        Raises `ValueError` if it cannot listen.
        """
        LifecycleNodeMixin.__init__(self)
        self._change_state = self._service_change_state.callback
        self._service_change_state.callback = self.on_change_state
        self.create_service(SetBool, "~/enable", self.on_enable)
        if self.parameters.read(Life).autostart:
            if self.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                raise ValueError(self.failure)
            self.trigger_activate()

    def listen(self) -> list[Subscription]:
        """Start from nothing, inactive; return all that is subscribed."""
        raise NotImplementedError

    def act(self, active: bool) -> None:
        """Begin what an active node does, or an inactive one."""
        raise NotImplementedError

    @property
    def life(self) -> str:
        """State: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def on_change_state(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        """Change the state, if it has the transition that is asked for.

        The mixin of rclpy would raise, and end the node, if it has not.
        """
        asked = request.transition
        there = {label: number for number, label, *_ in self._state_machine.available_transitions}
        if asked.label in there if asked.label else asked.id in there.values():
            response = self._change_state(request, response)
            if not response.success:
                self.get_logger().error(f"still {self.life}: {self.failure}")
            return response
        wanted = repr(asked.label) if asked.label else f"of id {asked.id}"
        has = ", ".join(f"{label} ({number})" for label, number in there.items()) or "none"
        self.get_logger().warning(f"no transition {wanted}: {self.life}, from where it has {has}")
        response.success = False
        return response

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to listen."""
        try:
            self.inputs = self.listen()
        except ValueError as error:
            self.failure = str(error)
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Be active."""
        self.act(True)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Be inactive."""
        self.act(False)
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Hear nothing any more."""
        while self.inputs:
            self.destroy_subscription(self.inputs.pop())
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Hear nothing any more, for good."""
        return self.on_cleanup(state)

    def on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Become active or inactive; what is active already, and may have given up, begins anew."""
        wanted = ACTIVE if request.data else INACTIVE
        try:
            if self.life == wanted:
                self.act(bool(request.data))
            else:
                self.trigger_activate() if request.data else self.trigger_deactivate()
        except RCLError:  # not from this state
            self.get_logger().warning(f"cannot become {wanted}: {self.life}")
        response.success, response.message = self.life == wanted, self.life
        return response
