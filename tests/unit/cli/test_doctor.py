"""The findings of `cogmap doctor`."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import pytest

from cogmap.bus.discovery import Process, Role, System, Use
from cogmap.bus.interface import Member
from cogmap.cli.doctor import installation
from cogmap.cli.doctor.observed import Observed
from cogmap.cli.doctor.system import examine
from cogmap.runtime.notes import LATE_ANSWERS, note
from cogmap.schemas import topics
from cogmap.schemas.process import Health, Paused
from cogmap.schemas.sensing import MotorCommand, SpeedLimit
from cogmap.schemas.topics import Topic

SENSORY = Member("sensory", "sensory")
WITH_MOTOR = ("sensory", "motor")


def health(at_s: float, **changes: object) -> Health:
    facts = {
        "module": "sensory",
        "instance": "sensory",
        "ready": True,
        "uptime_s": at_s,
        "received": {},
        "emitted": {"sensory/scan": round(5 * at_s)},
        "rejected": {},
        "superseded": {},
        "gaps": {},
        "queued": 0,
        "busy": 0.2,
        "compute_p50_ms": 1.0,
        "compute_p99_ms": 2.0,
        "memory_mb": 50.0,
    }
    return Health(**(facts | changes))  # type: ignore[arg-type]


def system(role: Role = Role.PUBLISHES, topic: Topic = topics.SCAN) -> System:
    process = Process("1", SENSORY)
    use = Use(topic.name, role, process)
    return System("agent", (process,), (use,))


def findings(
    observed: Observed, on: System | None = None, expected: Sequence[str] = ("sensory",)
) -> list[str]:
    return [str(finding) for finding in examine(expected, observed, on or system())]


def observed(*reports: Health, clock_rate: float | None = 1.0) -> Observed:
    by_instance = {"sensory": list(reports)} if reports else {}
    return Observed({SENSORY}, by_instance, clock_rate)


def two_publishers() -> System:
    """A system in which sensory and sensory-2 may publish scans."""
    processes = (Process("1", SENSORY), Process("2", Member("sensory", "sensory-2")))
    uses = [Use(topics.SCAN.name, Role.PUBLISHES, process) for process in processes]
    return System("agent", processes, tuple(uses))


def test_two_publishers_of_a_topic_that_one_alone_may_publish_are_named() -> None:
    found = findings(observed(health(1.0), health(2.0), health(3.0)), two_publishers())

    assert found == [
        "sensory/scan: sensory, sensory-2 publish it, and contradict each other: "
        "end all but one of them"
    ]


def test_a_process_that_has_published_none_of_a_topic_contradicts_nobody() -> None:
    well = observed(health(1.0), health(2.0), health(3.0))
    well.health["sensory-2"] = [health(1.0, emitted={}), health(3.0, emitted={})]

    assert findings(well, two_publishers()) == []


def test_a_system_that_is_well_has_no_findings() -> None:
    well = observed(health(10), health(11), health(12))

    assert findings(well) == []


def test_a_robot_that_is_commanded_nothing_is_named_unless_somebody_wants_time_to_stand() -> None:
    well = observed(health(10), health(11), health(12))
    well.ready.add(Member("motor", "motor"))
    well.health["motor"] = [health(10, emitted={}), health(12, emitted={})]

    (finding,) = findings(well, expected=WITH_MOTOR)
    assert finding.startswith("motor: it commanded nothing while I looked")
    well.add(Paused(is_paused=True))
    assert findings(well, expected=WITH_MOTOR) == []

    well.add(Paused(is_paused=False))
    well.add(MotorCommand(left_wheel_rad_s=0.0, right_wheel_rad_s=0.0))
    assert findings(well, expected=WITH_MOTOR) == []


def test_a_module_that_is_not_there_is_named() -> None:
    old = observed(health(100), health(102))

    (finding,) = findings(old, expected=["sensory", "epam"])

    assert finding.startswith("epam: no instance of it is on the bus")


def test_a_module_that_reports_nothing_is_named() -> None:
    (finding,) = findings(observed())

    assert finding.startswith("sensory: it is on the bus but reports nothing")


def test_a_module_that_is_not_ready_is_named() -> None:
    (finding,) = findings(observed(health(100, ready=False), health(102, ready=False)))

    assert finding.startswith("sensory: it is not ready")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"gaps": {"odometry": 3}}, "sensory: 3 messages of odometry never reached it"),
        ({"rejected": {"camera/stereo": 2}}, "sensory: it rejected 2 messages of camera/stereo"),
        ({"notes": ["1 faults"]}, "sensory: 1 faults"),
    ],
)
def test_what_a_module_complains_of_is_a_finding(changes: dict[str, object], sentence: str) -> None:
    (finding,) = findings(observed(health(10), health(12, **changes)))

    assert finding.startswith(sentence)


def queued(*numbers: int) -> Observed:
    """A module that reports so many messages in its queue, second by second."""
    return observed(*[health(10 + second, queued=number) for second, number in enumerate(numbers)])


def test_a_queue_that_grows_is_named_and_one_that_shrinks_is_not() -> None:
    (finding,) = findings(queued(5, 20, 40))

    assert finding.startswith("sensory: its queue grows, to 40 messages")
    assert findings(queued(5, 40, 20)) == []


@pytest.mark.parametrize(
    ("number", "is_off"), [(8, False), (10, False), (12, False), (6, True), (14, True), (0, True)]
)
def test_a_topic_with_a_rate_far_from_the_tables_is_named(number: int, is_off: bool) -> None:
    first = health(10, emitted={"sensory/scan": 50})
    last = health(12, emitted={"sensory/scan": 50 + number})

    found = findings(observed(first, last))

    assert [
        finding.startswith(f"sensory/scan: {number / 2:.1f} Hz, the table has 5 Hz")
        for finding in found
    ] == [True] * is_off


def test_rates_mean_nothing_in_lockstep_and_follow_the_clock_otherwise() -> None:
    before = health(10, emitted={"sensory/scan": 0})
    after = health(12, emitted={"sensory/scan": 5})

    in_lockstep = observed(before, after, clock_rate=0.0)
    at_half_speed = observed(before, after, clock_rate=0.5)
    in_real_time = observed(before, after, clock_rate=1.0)

    assert findings(in_lockstep) == []
    assert findings(at_half_speed) == []
    assert len(findings(in_real_time)) == 1


def test_a_module_that_subscribes_to_the_truth_is_named() -> None:
    cheating = system(Role.SUBSCRIBES, topics.TRUE_POSE)
    found = findings(observed(health(10), health(12)), cheating)

    assert found == ["sensory: it subscribes to truth/pose: no module may see the ground truth"]


def test_an_old_python_is_named() -> None:
    (old,) = installation.python_version((3, 10))
    assert str(old) == "Python: this is 3.10: install Python 3.11 or newer and run `make setup`"

    assert list(installation.python_version((3, 12))) == []


def test_rendering_is_at_home_on_its_python_and_platform() -> None:
    assert list(installation.rendering((3, 11), "linux", "x86_64")) == []


@pytest.mark.parametrize(
    ("version", "platform", "machine"),
    [((3, 12), "linux", "x86_64"), ((3, 11), "darwin", "arm64")],
    ids=["newer Python", "another platform"],
)
def test_a_python_or_platform_that_renders_nothing_is_named(
    version: tuple[int, int], platform: str, machine: str
) -> None:
    (finding,) = installation.rendering(version, platform, machine)

    assert "needs Python 3.11 on Linux x86-64" in finding.wrong
    assert "cogmap run --tour" in finding.remedy


def test_a_dependency_that_is_missing_or_of_another_version_is_named() -> None:
    needs = ["numpy>=0.0.1,<0.1", "no-such-package-here>=1.0", "msgspec>=0.1"]

    found = installation.dependencies(installation.required(needs))

    assert [finding.about for finding in found] == ["numpy", "no-such-package-here"]


def test_what_rendering_needs_is_required_and_another_extra_is_not() -> None:
    needs = [
        "numpy>=2.4,<3",
        'torch>=2.15; extra == "train"',
        'lz4>=4.4; python_version > "3"',
        'pybullet>=3.2; extra == "rendering"',
        'evo>=1; python_version < "3"',
    ]

    names = [requirement.name for requirement in installation.required(needs)]

    assert names == ["numpy", "lz4", "pybullet"]


def test_the_installed_package_names_what_it_needs() -> None:
    requirements = installation.required(metadata.requires("cogmap") or [])

    names = {requirement.name for requirement in requirements}
    assert {"eclipse-zenoh", "numpy", "msgspec", "pybullet"} <= names
    assert "torch" not in names


def test_a_place_for_runs_that_cannot_be_written_to_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    assert list(installation.write_access(tmp_path / "runs")) == []

    (finding,) = installation.write_access(tmp_path / "file" / "runs")
    assert "is a file" in finding.wrong


def test_a_recording_has_rates_of_its_own() -> None:
    fast = {"emitted": {"sensory/scan": 300}}
    played = observed(health(10), health(12, **fast))
    played.ready.add(Member("player", "player"))
    played.health["player"] = [health(10, module="player", instance="player")]

    assert any("the table has" in finding for finding in findings(played))
    assert examine(["player", "sensory"], played, system()) == []


def test_a_topic_of_which_more_is_received_than_modules_publish_is_named() -> None:
    reports = [health(at_s, received={"sensory/motion": int(450 * at_s)}) for at_s in (1.0, 2.0)]

    assert findings(observed(*reports)) == [
        "sensory/motion: 450 Hz are received, and those who report their health publish 0.0 Hz: "
        "find out who else publishes it, and end that"
    ]


def test_a_note_that_states_its_remedy_is_shown_with_it() -> None:
    told = note("answers come 200 ms after their tasks", "shorten the way")
    found = findings(observed(health(1.0), health(2.0, notes=[told, "something else"])))

    assert found == [
        "sensory: answers come 200 ms after their tasks: shorten the way",
        "sensory: something else: see its log",
    ]


def test_where_answers_are_late_by_their_way_the_machine_is_not_blamed() -> None:
    slow = MotorCommand(
        stamp_ns=1, left_wheel_rad_s=1, right_wheel_rad_s=1, slowed_by=SpeedLimit.POSE_AGE
    )
    for notes in ([], [note(f"{LATE_ANSWERS} 200 ms after their tasks", "shorten the way")]):
        seen = observed(health(1.0), health(2.0, notes=notes))
        for _ in range(10):
            seen.add(slow)
        found = findings(seen)

        assert any(finding.startswith("machine") for finding in found) is not bool(notes)
