"""How messages are printed: which parts of them, and in which form."""

from __future__ import annotations

import csv
import enum
import functools
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import click
import msgspec

from cogmap.cli.options import json_option
from cogmap.errors import UsageError
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.render import field, fields_of, to_jsonable, to_text

Command = Callable[..., None]
CUT = "..."


class Form(enum.Enum):
    """What a message becomes; TEXT is YAML, FLOW in one line."""

    TEXT = ""
    FLOW = "--flow-style"
    JSON = "--json"
    CSV = "--csv"
    RAW = "--raw"


@dataclass(frozen=True)
class Style:
    """How to print a message: its `fields`, all of it if there are none, in a form.

    Arrays become type and shape where `no_arrays`, strings their length where `no_strings`; lists
    and strings longer than `longest` are cut. `full` prints all values of arrays.
    """

    fields: Sequence[str] = ()
    form: Form = Form.TEXT
    full: bool = False
    no_arrays: bool = False
    no_strings: bool = False
    longest: int | None = None

    def text(self, message: Message, payload: bytes | memoryview) -> str:
        """Write a message that travelled as `payload`. Raises UsageError if it lacks a field."""
        match self.form:
            case Form.RAW:
                return bytes(payload).hex()
            case Form.JSON:
                return json.dumps(self.jsonable(message))
            case Form.CSV:
                return comma_separated(self.jsonable(message))
            case _:
                is_flow = self.form is Form.FLOW
                return to_text(self._chosen(message), self.full, flow=is_flow)

    def jsonable(self, message: Message) -> Any:
        """Return what is printed of a message as dicts, lists and scalars. Raises UsageError."""
        chosen = self._chosen(message)
        if self.form is Form.CSV and not self.full:
            return shortened(chosen, Style(no_arrays=True))
        return to_jsonable(chosen, self.full)

    def _chosen(self, message: Message) -> Any:
        """Return the fields of a message, one as it is, several by their paths."""
        part: Any = message
        if len(self.fields) == 1:
            part = _part(message, self.fields[0])
        elif self.fields:
            part = {path: _part(message, path) for path in self.fields}

        is_shortened = self.no_arrays or self.no_strings or self.longest is not None
        return shortened(part, self) if is_shortened else part


def _part(message: Message, path: str) -> Any:
    try:
        return field(message, path)
    except LookupError as error:
        raise UsageError(f"--field {path}: {error.args[0]}") from None


def shortened(part: Any, style: Style) -> Any:
    """Return `part` as dicts, lists, arrays and scalars, without what `style` leaves out."""
    if isinstance(part, enum.Enum):
        part = part.value

    shown = part
    match part:
        case Array() | Matrix():
            if style.no_arrays:
                shown = f"<array type: {part.dtype}{list(part.shape)}>"
        case msgspec.Struct():
            shown = shortened(fields_of(part), style)
        case dict():
            shown = {name: shortened(value, style) for name, value in part.items()}
        case list() | tuple():
            shown = [shortened(value, style) for value in part[: style.longest]]
            if len(shown) < len(part):
                shown.append(CUT)
        case str():
            shown = f"<string length: {len(part)}>" if style.no_strings else _cut(part, style)
    return shown


def _cut(text: str, style: Style) -> str:
    if style.longest is None or len(text) <= style.longest:
        return text
    return f"{text[: style.longest]}{CUT}"


def comma_separated(part: Any) -> str:
    """Write all scalars in `part`, in order, as one line of CSV."""

    def scalars(part: Any) -> Iterator[Any]:
        if isinstance(part, dict):
            part = list(part.values())
        if not isinstance(part, list | tuple):
            yield part
            return
        for item in part:
            yield from scalars(item)

    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(scalars(part))
    return line.getvalue()


_OPTIONS = (
    click.option(
        "--field",
        "fields",
        multiple=True,
        metavar="PATH",
        help="Print only this part, such as objects.0.label; may be repeated.",
    ),
    click.option("-f", "--full", "--full-length", is_flag=True, help="Print all values of arrays."),
    click.option(
        "-l",
        "--truncate-length",
        "longest",
        type=click.IntRange(min=0),
        metavar="N",
        help="Cut lists and strings that are longer.",
    ),
    click.option(
        "--no-arr", "no_arrays", is_flag=True, help="Print only type and shape of arrays."
    ),
    click.option("--no-str", "no_strings", is_flag=True, help="Print only the length of strings."),
    click.option("--flow-style", "as_flow", is_flag=True, help="Print each message in one line."),
    click.option(
        "--csv",
        "as_csv",
        is_flag=True,
        help="Print each message as one line of comma-separated values.",
    ),
    click.option("--raw", "as_raw", is_flag=True, help="Print the bytes of each message, as hex."),
    json_option,
)


def style_options(command: Command) -> Command:
    """Give `command` the options of how to print messages, as a `style`."""

    @functools.wraps(command)
    def with_style(
        *,
        fields: tuple[str, ...],
        full: bool,
        longest: int | None,
        no_arrays: bool,
        no_strings: bool,
        as_flow: bool,
        as_csv: bool,
        as_raw: bool,
        as_json: bool,
        **own: Any,
    ) -> None:
        chosen = {Form.FLOW: as_flow, Form.JSON: as_json, Form.CSV: as_csv, Form.RAW: as_raw}
        form = only([form for form, is_chosen in chosen.items() if is_chosen])
        if form is Form.RAW and fields:
            raise UsageError("--raw and --field: a message has its bytes as a whole, leave one out")
        style = Style(fields, form, full, no_arrays, no_strings, longest)
        command(style=style, **own)

    decorated: Command = with_style
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return decorated


def only(forms: Sequence[Form]) -> Form:
    """Return the form that was chosen, TEXT if none was. Raises UsageError if several were."""
    if len(forms) > 1:
        named = " and ".join(form.value for form in forms)
        raise UsageError(f"{named} exclude each other: choose one")
    return forms[0] if forms else Form.TEXT
