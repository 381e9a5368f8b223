"""Messages as `cogmap topic echo` and `cogmap log cat` print them."""

from __future__ import annotations

import json

import click
import pytest
from click.testing import CliRunner, Result

from cogmap.bus.codec import encode
from cogmap.cli.messages.style import Form, Style, style_options
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.examples import example
from cogmap.schemas.sensing import Odometry

ODOMETRY = Odometry(speed_m_s=1.5, turn_rate_rad_s=0.0, dt_s=0.05, stamp_ns=7, seq=3, source="sim")
SELF_MOTION = example(topics.SELF_MOTION)


def printed(style: Style) -> str:
    return style.text(ODOMETRY, encode(ODOMETRY))


def test_one_field_is_shown_or_those_that_there_are_are_named() -> None:
    assert printed(Style(("speed_m_s",))) == "1.5"

    with pytest.raises(UsageError, match=r"--field speed: no 'speed' .*speed_m_s"):
        printed(Style(("speed",)))


def test_every_field_that_is_named_is_shown() -> None:
    fields = ("dt_s", "speed_m_s")

    assert printed(Style(fields)) == "dt_s: 0.05\nspeed_m_s: 1.5"
    assert printed(Style(fields, Form.CSV)) == "0.05,1.5"
    assert json.loads(printed(Style(fields, Form.JSON))) == {"dt_s": 0.05, "speed_m_s": 1.5}


def test_csv_is_a_line_a_message() -> None:
    assert printed(Style(form=Form.CSV)) == "7,3,sim,1.5,0.0,0.05"


def test_flow_style_is_yaml_in_a_line() -> None:
    fields = ("source", "speed_m_s")

    assert printed(Style(fields, Form.FLOW)) == "{source: sim, speed_m_s: 1.5}"


def test_raw_is_the_bytes_as_they_travelled() -> None:
    assert bytes.fromhex(printed(Style(form=Form.RAW))) == encode(ODOMETRY)


def test_the_numbers_of_arrays_are_left_out_where_asked() -> None:
    shown = Style(no_arrays=True).text(SELF_MOTION, b"")

    assert "motions: <array type: <f8[4, 3]>" in shown.replace("'", "")


def test_strings_are_left_out_where_asked() -> None:
    assert printed(Style(("source",), no_strings=True)) == "'<string length: 3>'"


def test_lists_and_strings_are_cut_where_asked() -> None:
    message = example(topics.PRESENCE)
    name = message.module

    assert Style(("module",), longest=2).text(message, b"") == f"{name[:2]}..."
    assert Style(("module",), longest=len(name)).text(message, b"") == name


@pytest.fixture
def styled() -> click.Command:
    """A command that prints the options of style that it was given."""

    @click.command()
    @style_options
    def command(style: Style) -> None:
        click.echo(style.form.name)

    return command


def invoked(command: click.Command, *words: str) -> Result:
    return CliRunner().invoke(command, list(words))


def test_a_style_is_given_by_options(styled: click.Command) -> None:
    assert invoked(styled).stdout == "TEXT\n"
    assert invoked(styled, "--csv").stdout == "CSV\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--csv", "--json"), "--json and --csv exclude each other: choose one"),
        (("--raw", "--field", "seq"), "--raw and --field: .* leave one out"),
    ],
)
def test_two_forms_at_once_are_refused(
    styled: click.Command, words: tuple[str, ...], sentence: str
) -> None:
    error = invoked(styled, *words).exception

    assert isinstance(error, UsageError)
    with pytest.raises(UsageError, match=sentence):
        raise error
