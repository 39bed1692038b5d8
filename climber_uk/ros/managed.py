"""A managed (lifecycle) node that configures and activates itself, unless a manager is to."""

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
    """The start of a managed node."""

    autostart: bool = parameter(True, "", "become active by itself, without a lifecycle manager")


class ManagedNode(LifecycleNodeMixin, ClimberNode):
    """A lifecycle node: subscribes when configured (`listen`), and gets its state by `act`.

    The service `~/enable` activates (true) and deactivates (false).
    """

    def __init__(self, name: str) -> None:
        ClimberNode.__init__(self, name)
        self.parameters.declare(Life)
        self.inputs: list[Subscription] = []
        self.failure = ""  # why it could not be configured

    def start_life(self) -> None:
        """Offer the lifecycle services and, with `autostart`, configure and activate.

        Raises `ValueError` if it cannot be configured.
        """
        LifecycleNodeMixin.__init__(self)
        # private, as is `_state_machine`: there is no other way between a request and the mixin
        self._change_state = self._service_change_state.callback
        self._service_change_state.callback = self.on_change_state
        self.create_service(SetBool, "~/enable", self.on_enable)
        if self.parameters.read(Life).autostart:
            if self.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                raise ValueError(self.failure)
            self.trigger_activate()

    def listen(self) -> list[Subscription]:
        """Become inactive and subscribe; return the subscriptions. `ValueError` if it cannot."""
        raise NotImplementedError

    def act(self, active: bool) -> None:
        """Take up the behaviour of an active node, or of an inactive one."""
        raise NotImplementedError

    @property
    def life(self) -> str:
        """Lifecycle state: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def on_change_state(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        """Service ~/change_state: make a transition that there is from this state.

        For one that there is not, rclpy's own callback raises, which would end the node.
        """
        requested = request.transition
        there = {label: number for number, label, *_ in self._state_machine.available_transitions}
        if requested.label in there if requested.label else requested.id in there.values():
            response = self._change_state(request, response)
            if not response.success:
                self.get_logger().error(f"still {self.life}: {self.failure}")
            return response
        wanted = repr(requested.label) if requested.label else f"of id {requested.id}"
        has = ", ".join(f"{label} ({number})" for label, number in there.items()) or "none"
        self.get_logger().warning(f"no transition {wanted}: {self.life}, from where it has {has}")
        response.success = False
        return response

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Transition: subscribe; fails with a `ValueError` of `listen`."""
        try:
            self.inputs = self.listen()
        except ValueError as error:
            self.failure = str(error)
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Transition: behave as an active node."""
        self.act(True)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Transition: behave as an inactive node."""
        self.act(False)
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Transition: end the subscriptions."""
        while self.inputs:
            self.destroy_subscription(self.inputs.pop())
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Transition: end the subscriptions, for good."""
        return self.on_cleanup(state)

    def on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Service ~/enable: activate or deactivate; repeated, it begins that state anew."""
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
