"""Real nodes in processes of their own, each test in a ROS domain of its own."""

import itertools
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import rclpy
from ament_index_python import PackageNotFoundError, get_package_prefix
from forking import EXAMPLES, PROGRAMS, Forked
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from climber_uk.ros.transport import reserved

HEEDED = "AMENT", "LD_", "PATH", "PYTHON", "RMW"  # as a program starts and imports


def heeded(environment):
    """What of an environment a program that is forked would not heed any more."""
    return {name: environment[name] for name in environment if name.startswith(HEEDED)}


USUAL = heeded(os.environ)  # that of the server that forks, as no test has changed it yet
OPTION = {False: "-p", True: "-r"}
TIMEOUT = 120.0  # [s] for whatever is waited for: machines are shared, discovery has a long tail
CONFIG = Path(__file__).parents[2] / "config"
# above 101, ports may be taken by others
WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
WORKERS = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
DOMAINS = itertools.count(os.getppid() * WORKERS + WORKER, WORKERS)
WORLDS = itertools.count()


def new_domain():
    """Return a ROS domain that nobody else is in now."""
    domain, mark = reserved_domain()
    mark.close()
    return domain


def reserved_domain():
    """Return a ROS domain that nobody else has, and what reserves it until that is closed."""
    domains = (number % (100 - 100 % WORKERS) + 1 for number in DOMAINS)
    domain, mark = next((domain, mark) for domain in domains if (mark := reserved(domain)))
    sweep(domain)
    return domain, mark


def sweep(domain):
    """Remove what processes that were killed left of a domain that nobody is in.

    Who finds such a port of shared memory waits a third of a second for its owner, again and again.
    """
    for file in Path("/dev/shm").glob("*fast*_port*"):
        port = int("".join(filter(str.isdigit, file.name)))
        if 0 <= port - 7400 - 250 * domain < 250:
            file.unlink(missing_ok=True)


def inhabitants(world):
    """Ids and command lines of all processes that were started in a world, by whichever of them.

    Its domain does not tell: whoever runs the tests may have nodes in it, or work in it.
    """
    mark = f"WORLD={world.environment['WORLD']}\0".encode()
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile, or is somebody else's
            if mark in (process / "environ").read_bytes():
                yield int(process.name), (process / "cmdline").read_bytes().decode()


def installation():
    """Where colcon has installed executables; None if it has not."""
    try:
        return Path(get_package_prefix("climber_uk")) / "lib" / "climber_uk"
    except (PackageNotFoundError, OSError):  # OSError: there is no installation at all
        return None


def executable(name):
    """Where `ros2 run` finds an executable after colcon, else beside this Python."""
    return (installation() or Path(sys.executable).parent) / name


def command(name):
    """How an executable of the package, or an example, is started."""
    return [sys.executable, example(name)] if example(name).is_file() else [executable(name)]


def example(name):
    """File of an example; there may be none."""
    return EXAMPLES / f"{name}.py"


class World:
    """One ROS domain with the processes started in it, and two nodes of the test's own.

    `node` speaks and calls, and has its callbacks executed. `ears` only listens: an executor that
    woke for each message of each topic would cost more than the nodes that are tested.
    """

    def __init__(self, directory):
        self.domain, self.mark = reserved_domain()
        own = {"ROS_DOMAIN_ID": str(self.domain), "WORLD": f"{os.getpid()}-{next(WORLDS)}"}
        self.environment = {**os.environ, **own}
        self.directory = directory
        self.processes = {}
        self.context = Context()
        rclpy.init(context=self.context, domain_id=self.domain)
        how = {"context": self.context, "start_parameter_services": False}
        self.node, self.ears = Node("test_speaks", **how), Node("test", **how)
        self.heard = []
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)

    def start(self, name, *arguments):
        """Start an executable of the package, or an example; its output is `log(name)`."""
        is_ours = example(name).is_file() or (name in PROGRAMS and not installation())
        if not is_ours or heeded(self.environment) != USUAL:
            return self.run(name, *command(name), *arguments)
        self.log_file(name).write_text("")
        self.processes[name] = Forked(name, arguments, self.log_file(name), self.environment)
        return self.processes[name]

    def run(self, name, *words, **how):
        """Start a command as `Popen` does; its output is `log(name)`."""
        with self.log_file(name).open("wb") as log:
            self.processes[name] = subprocess.Popen(
                words,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self.environment,
                **how,
            )
        return self.processes[name]

    def start_node(self, name, *parameters, config=None):
        """Start a node with parameters given as name:=value, topics renamed as /from:=/to."""
        file = ["--params-file", str(CONFIG / config)] if config else []
        given = [
            part for parameter in parameters for part in (OPTION[parameter[0] == "/"], parameter)
        ]
        return self.start(name, "--ros-args", *file, *given)

    def log_file(self, name):
        return self.directory / f"{name}.log"

    def log(self, name):
        return self.log_file(name).read_text()

    def wait(self, condition, what):
        """Spin until `condition()` holds, and return what it gave."""
        deadline, longest = time.monotonic() + TIMEOUT, 0.001
        while not (value := condition()):
            self.spin(longest)
            longest = min(2 * longest, 0.01)  # many answers come at once
            for name, process in self.processes.items():
                assert process.poll() in (None, 0), f"{name} failed:\n{self.log(name)}"
            if time.monotonic() > deadline:
                logs = "\n".join(f"{name}:\n{self.log(name)}" for name in self.processes)
                raise AssertionError(f"no {what} within {TIMEOUT} s\n{logs}")
        return value

    def spin(self, longest=0.01):
        """Wait [s] for a callback of `node`, and take the messages that are heard."""
        self.executor.spin_once(timeout_sec=longest)
        for subscription, received in self.heard:
            with subscription.handle:
                while found := subscription.handle.take_message(subscription.msg_type, False):
                    received.append(found[0])

    def subscribe(self, kind, topic, depth=1000):
        """Subscription, for those who look whether there is one; nothing is taken from it."""
        return self.ears.create_subscription(kind, topic, print, depth)

    def hear(self, kind, topic, depth=1000):
        """List that fills with the messages of a topic."""
        self.heard.append((self.subscribe(kind, topic, depth), received := []))
        return received

    def listen(self, kind, topic):
        """The same, once there is a publisher."""
        received = self.hear(kind, topic)
        self.wait(lambda: self.node.count_publishers(topic), f"publisher of {topic}")
        return received

    def speak(self, kind, topic):
        """Publisher of a topic that somebody listens to."""
        publisher = self.node.create_publisher(kind, topic, 1000)  # for those who are held up
        self.wait(publisher.get_subscription_count, f"subscriber of {topic}")
        return publisher

    def call(self, kind, service, request):
        """Response of a service."""
        client = self.node.create_client(kind, service)
        self.wait(client.service_is_ready, f"service {service}")
        future = client.call_async(request)
        self.wait(future.done, f"response of {service}")
        return future.result()

    def end(self, name, number=signal.SIGTERM):
        """End a process and return its exit status."""
        process = self.processes.pop(name)
        if process.poll() is None:
            process.send_signal(number)
        try:
            return process.wait(TIMEOUT)
        finally:
            process.kill()

    def close(self):
        """End all that was started in it, by the test or by what it started."""
        for process in self.processes.values():
            process.send_signal(signal.SIGCONT)  # one that is stopped hears of nothing else
            process.terminate()
        for process in self.processes.values():
            with suppress(subprocess.TimeoutExpired):
                process.wait(TIMEOUT)
            process.kill()
        for number, _ in inhabitants(self):
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        self.executor.shutdown()
        self.node.destroy_node()
        self.ears.destroy_node()
        self.context.try_shutdown()
        self.mark.close()
