"""The type of every option that takes a number: what is none gets a sentence that says what to do.

`with_numbers` gives it to the options of all commands by their annotations, so a new option has it
too.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, get_args, get_type_hints

import typer
from typer.models import OptionInfo

from rigidimeter.core.errors import UserError

_UNITS = {
    "s": "seconds",
    "hz": "Hz",
    "deg": "degrees",
    "nm": "N·m",
    "m2": "kg·m²",
    "kg": "kg",
    "m": "metres",
}
_WITH_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))\s*(\S+)", re.ASCII)
_COMMA = re.compile(r"([-+]?\d*),(\d+)", re.ASCII)
_EXAMPLE = 10


@dataclass(frozen=True)
class Number:
    """Reads a number of one option.

    Attributes
    ----------
    option : str
        Its name, such as ``--epoch-length-s``.
    whole : bool
        Whether it must be a whole number.
    low, high : float or None
        The smallest and the largest number that is allowed.
    unit : str
        In words, such as ``seconds``; empty without one.
    example : float
        A number that would be right.
    """

    option: str
    whole: bool
    low: float | None = None
    high: float | None = None
    unit: str = ""
    example: float = _EXAMPLE

    @property
    def __name__(self) -> str:
        return "INTEGER" if self.whole else "FLOAT"

    def __call__(self, given: str | float) -> float:
        """Return the number.

        Raises
        ------
        UserError
            If it is none, or out of range.

        Examples
        --------
        >>> Number("--epoch-length-s", whole=False)("2.5")
        2.5
        """
        try:
            value = float(given)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or (self.whole and value != int(value)):
            raise UserError(f"{self.option} {given}: {self._remedy(str(given).strip())}")
        for limit, beyond, words in (
            (self.low, self.low is not None and value < self.low, "at least"),
            (self.high, self.high is not None and value > self.high, "at most"),
        ):
            if beyond:
                raise UserError(f"{self.option} {given}: must be {words} {limit:g}")
        return int(value) if self.whole else value

    def _remedy(self, text: str) -> str:
        what = f"a {'whole ' * self.whole}number{f' of {self.unit}' * bool(self.unit)}"
        if (comma := _COMMA.fullmatch(text)) and not self.whole:
            return f"is not {what}; write {comma[1] or 0}.{comma[2]}"
        if (found := _WITH_UNIT.fullmatch(text)) and not self.whole:
            if found[2] == "%" and not self.unit:
                return f"is not {what}; write {float(found[1]) / 100:g}"
            # "20 sec" of seconds, and not "1 kHz" of Hz.
            if self.unit and self.unit[:3].casefold().startswith(found[2][:3].casefold()):
                return f"is not {what}; write {found[1]}"
        return f"is not {what}, such as {self.example:g}"


def with_numbers(app: typer.Typer) -> typer.Typer:
    """Return a program in which every option that takes numbers reads them by `Number`."""
    for command in app.registered_commands:
        if command.callback is not None:
            _give(command.callback)
    for group in app.registered_groups:
        if group.typer_instance is not None:
            with_numbers(group.typer_instance)
    return app


def _give(command: Callable[..., Any]) -> None:
    annotations = get_type_hints(command)
    for name, parameter in inspect.signature(command).parameters.items():
        option = parameter.default
        kinds = set(_leaves(annotations[name])) - {type(None)}
        if not isinstance(option, OptionInfo) or kinds not in ({float}, {int}):
            continue
        (declared, *_) = option.param_decls or ()
        unit = next(
            (_UNITS[part] for part in (declared.rpartition("-")[2], str(option.metavar).lower())
             if part in _UNITS), "",
        )  # fmt: skip
        known = (option.default, option.min)
        example = next((n for n in known if isinstance(n, int | float) and n), _EXAMPLE)
        option.parser = Number(declared, kinds == {int}, option.min, option.max, unit, example)


def _leaves(annotation: Any) -> Iterator[Any]:
    """Yield the types that an annotation is made of, such as float of ``tuple[float, float]``."""
    if arguments := get_args(annotation):
        for each in arguments:
            yield from _leaves(each)
    else:
        yield annotation
