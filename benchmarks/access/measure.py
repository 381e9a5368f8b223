"""Who gets in, what each may do there, and what that costs."""

from __future__ import annotations

import click

from benchmarks.access import latency
from benchmarks.access.grounds import Grounds, grounds, session
from benchmarks.access.trials import NOBODY, Trial, shut_out, trials_of
from benchmarks.benchmark import Setting
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.bus.access.subjects import SUBJECTS
from cogmap.cli.progress import bar

THRESHOLDS = {
    "allowed_by_mistake": at_most(0),
    "denied_by_mistake": at_most(0),
    "latency_over_plain": at_most(1.15),
}
MESSAGES = 3000
STRANGER = "stranger"
NO_CERTIFICATE = "no certificate"
PLAIN = "no keys"
OPTIONS = (
    click.Option(
        ["--messages"],
        type=click.IntRange(10, 1_000_000),
        default=MESSAGES,
        show_default=True,
        help="How many messages of each size are timed with keys, and as many without.",
    ),
    click.Option(
        ["--zenohd"],
        default="",
        metavar="PROGRAM",
        help="Try to get into this router, with the configuration that `cogmap keys make` writes, "
        "in the place of ours.",
    ),
)


def measure(setting: Setting, *, messages: int = MESSAGES, zenohd: str = "") -> Metrics:
    """Try all that there is to do on the bus: as every module and role, as a stranger with another
    site's certificate, with no certificate, and without TLS.

    Each publishes, deletes, subscribes, asks and answers on every topic, keeps and asks caches, and
    holds every kind of token, past all checks of ours but the router's. Then messages are timed by
    TLS with rules and by plain TCP, in turn. Takes about a minute, on this machine alone.
    """
    with grounds(setting.folder, zenohd) as place:
        trials = tried(place, (*SUBJECTS, STRANGER, NO_CERTIFICATE, PLAIN))
    for trial in trials:
        if trial.is_allowed != trial.is_achieved:
            outcome = "achieves" if trial.is_achieved else "may, but cannot,"
            setting.announce(f"{trial.who} {outcome} {trial.deed}")

    setting.announce(f"timing {messages} messages of two sizes, with keys and without")
    return counts(trials) | latency.measure(setting.folder, messages)


def tried(place: Grounds, parties: tuple[str, ...]) -> list[Trial]:
    """Return the trials of all parties."""
    found = []
    with bar("trying to get in") as progress:
        for number, who in enumerate(parties):
            found += trials_by(who, place)
            progress((number + 1) / len(parties))
    return found


def trials_by(who: str, place: Grounds) -> list[Trial]:
    """Return the trials of one party: a subject, or one of those who have no right keys."""
    trusts = place.keys("motor").authority
    if who == STRANGER:
        opened = session(place.endpoint, place.strangers_keys("motor"))
    elif who == NO_CERTIFICATE:
        opened = session(place.endpoint, None, trusts)
    elif who == PLAIN:
        opened = session(place.endpoint.replace("tls/", "tcp/"), None)
    else:
        opened = session(place.endpoint, place.keys(who))

    subject = SUBJECTS.get(who, NOBODY)
    if opened is None:
        return shut_out(who, subject)
    try:
        return trials_of(who, subject, opened, place)
    finally:
        opened.close()  # type: ignore[no-untyped-call]


def counts(trials: list[Trial]) -> Metrics:
    """Count the trials that ended otherwise than the table has it."""
    by_mistake = [trial for trial in trials if trial.is_allowed != trial.is_achieved]
    allowed = sum(trial.is_achieved for trial in by_mistake)
    return {
        "allowed_by_mistake": float(allowed),
        "denied_by_mistake": float(len(by_mistake) - allowed),
        "trials": float(len(trials)),
        "trials_allowed": float(sum(trial.is_allowed for trial in trials)),
        "parties": float(len({trial.who for trial in trials})),
    }
