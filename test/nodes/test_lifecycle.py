"""What a lifecycle manager asks and the state does not allow is refused, and changes nothing."""

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import SetBool
from test_uk_torque_controller import UNGUARDED, Loop

pytestmark = pytest.mark.nodes

NAME = "uk_torque_controller"
CONFIGURE, CLEAN_UP, ACTIVATE, DEACTIVATE = 1, 2, 3, 4
SHUT_DOWN = {"unconfigured": 5, "inactive": 6, "active": 7}
# the transitions that each state has, and those that lead to it from the start
STATES = {
    "unconfigured": ({1: "configure", 5: "shutdown"}, []),
    "inactive": ({2: "cleanup", 3: "activate", 6: "shutdown"}, [CONFIGURE]),
    "active": ({4: "deactivate", 7: "shutdown"}, [CONFIGURE, ACTIVATE]),
    "finalized": ({}, [SHUT_DOWN["unconfigured"]]),
}
LABELS = ["configure", "cleanup", "activate", "deactivate", "shutdown", "create", "destroy"]
LABELS += ["transition_success", "Activate", "active", "nonsense", "\u03c4"]


@pytest.mark.parametrize("state", STATES)
def test_what_does_not_fit_the_state_is_refused_in_words_and_changes_nothing(world, state):
    allowed, way = STATES[state]
    world.start_node(NAME, *UNGUARDED, "autostart:=false", "odometry_timeout:=1.0")
    client = world.node.create_client(ChangeState, f"{NAME}/change_state")
    world.wait(client.service_is_ready, "the service")

    def ask(*transitions):
        """Whether each of the transitions was made."""
        asked = [client.call_async(ChangeState.Request(transition=t)) for t in transitions]
        world.wait(lambda: all(future.done() for future in asked), "answers")
        return [future.result().success for future in asked]

    for transition in way:
        assert ask(Transition(id=transition)) == [True]
    follows = state == "active"
    if follows:
        loop = Loop(world)
        loop.plan()
        loop.follows()
    ids = [Transition(id=number) for number in range(256) if number not in allowed]
    labels = [Transition(label=label) for label in LABELS if label not in allowed.values()]
    for transition in [*ids, *labels]:
        assert ask(transition) == [False]
        if follows and transition.id % 50 == 3:
            loop.follows()
    if follows:
        loop.follows()
    lines = [line for line in world.log(NAME).splitlines() if "no transition" in line]
    assert len(lines) == len(ids) + len(labels)
    assert all(f"{state}, from where it has" in line for line in lines)
    wanted = state in ("inactive", "active")
    enable = world.call(SetBool, f"{NAME}/enable", SetBool.Request(data=True))
    assert (enable.success, enable.message) == (wanted, "active" if wanted else state)
    assert world.end(NAME) == 0


def test_what_fits_the_state_is_taken_by_its_label_as_well(world):
    world.start_node(NAME, *UNGUARDED, "autostart:=false", "odometry_timeout:=1.0")
    for label in ("configure", "activate", "deactivate", "cleanup", "shutdown"):
        request = ChangeState.Request(transition=Transition(label=label))
        assert world.call(ChangeState, f"{NAME}/change_state", request).success
    assert world.end(NAME) == 0
