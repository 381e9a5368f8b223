"""When a shell starts its module, and whom it sees come and go, over either bus."""

from __future__ import annotations

from cogmap.bus.codec import decode
from cogmap.bus.interface import Member
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.process import Presence
from cogmap.schemas.sensing import Odometry
from cogmap.testing import odometry
from tests.support.system.networks import Network, Peer, spin_until

COUNT = 20


class Listener:
    """One of the listeners to odometry, in a shell that is not open yet."""

    def __init__(self, network: Network, instance: str) -> None:
        self.seqs: list[int] = []
        module = Module("listener", instance).on(topics.ODOMETRY, self._on_odometry)
        self.shell = Shell(module, network.join(), health=False)

    def _on_odometry(self, message: Odometry) -> None:
        self.seqs.append(message.seq)


def test_those_that_a_start_requires_miss_nothing(network: Network) -> None:
    first = [odometry(seq) for seq in range(COUNT)]
    sim = Module("sim").on_start(lambda: first, requires={"listener": 2}, emits=[topics.ODOMETRY])
    starting = Shell(sim, network.join(), health=False)
    one = Listener(network, "one")
    two = Listener(network, "two")
    shells = (starting, one.shell, two.shell)
    starting.open()

    one.shell.open()
    spin_until(lambda: starting.missing == {"listener": 1}, starting)
    assert (one.seqs, two.seqs) == ([], [])

    two.shell.open()
    spin_until(lambda: len(one.seqs) == len(two.seqs) == COUNT, *shells)

    assert one.seqs == list(range(COUNT))
    assert two.seqs == list(range(COUNT))
    for shell in shells:
        shell.close()


def test_a_start_happens_once_though_a_required_module_restarts(network: Network) -> None:
    started: list[int] = []
    sim = Module("sim").on_start(lambda: started.append(1), requires={"action": 1})
    shell = Shell(sim, network.join(), health=False)
    shell.open()

    for _ in range(2):
        action = Shell(Module("action"), network.join(), health=False)
        action.open()
        spin_until(lambda: not shell.missing, shell)
        action.close()
        spin_until(lambda: bool(shell.missing), shell)

    assert started == [1]
    shell.close()


def test_a_module_that_observes_presence_learns_who_comes_and_goes(network: Network) -> None:
    observed: list[Presence] = []
    module = Module("workspace").on(topics.PRESENCE, observed.append, emits=[topics.PRESENCE])
    shell = Shell(module, network.join(), health=False)
    worker = network.join()
    shell.open()

    worker.announce(Member("codelets", "codelets-1"))
    spin_until(lambda: any(presence.module == "codelets" for presence in observed), shell)
    worker.close()
    spin_until(lambda: any(not presence.alive for presence in observed), shell)

    came, went = (presence for presence in observed if presence.module == "codelets")
    assert (came.instance, came.alive) == ("codelets-1", True)
    assert (went.instance, went.alive) == ("codelets-1", False)
    shell.close()


def test_a_worker_that_is_only_a_token_leaves_for_the_module_and_for_the_log(
    network: Network,
) -> None:
    observed: list[Presence] = []
    module = Module("workspace").observing(observed.append, heartbeats=["codelets"])
    shell = Shell(module, network.join())
    recorded = Peer(network.join(), topics.PRESENCE)
    shell.open()
    worker = Shell(Module("codelets", "codelets-1"), network.join())
    worker.open()
    network.join().announce(Member("codelets", "ghost"))

    def of(instance: str) -> list[bool]:
        return [each.alive for each in observed if each.instance == instance]

    spin_until(lambda: of("ghost") == [True, False], shell, worker)
    ghostly = "codelets/ghost is on the bus and has reported no health at all"
    assert any(note.startswith(ghostly) for note in shell.notes)
    assert of("codelets-1") == [True]

    arrivals = recorded.take(len(observed))
    assert [decode(topics.PRESENCE, each.payload) for each in arrivals] == observed
    worker.close()
    shell.close()
