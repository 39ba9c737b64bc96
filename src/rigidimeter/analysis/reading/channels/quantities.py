"""The quantities that a recording may hold, and the words for them in six languages.

A quantity is found in the name of a column by its words, as in `Torque`, `Drehmoment [Nm]` or
`vitesse angulaire (deg/s)`: English, German, French, Italian, Spanish and
Dutch.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass

from rigidimeter.analysis.reading.formats.table import nearest
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import EMG_CHANNELS


@dataclass(frozen=True)
class Quantity:
    """A quantity with the name under which it is stored.

    Parameters
    ----------
    name : str
        As options call it, such as ``torque``.
    standard : str
        As it is stored, with its unit, such as ``torque_nm``.
    si : str
        The unit in which it is stored, as `pint` writes it.
    usual : tuple of str
        The units in which files mostly have it, the stored one first.
    """

    name: str
    standard: str
    si: str
    usual: tuple[str, ...]


QUANTITIES = (
    Quantity("time", "time_s", "second", ("s", "ms")),
    Quantity("torque", "torque_nm", "newton*meter", ("Nm",)),
    Quantity("angle", "angle_rad", "radian", ("rad", "deg")),
    Quantity("velocity", "velocity_rad_s", "radian/second", ("rad/s", "deg/s")),
    Quantity("velocity_command", "velocity_command_rad_s", "radian/second", ("rad/s", "deg/s")),
    Quantity("perturbation", "perturbation_nm", "newton*meter", ("Nm",)),
    *(
        Quantity("emg" if muscle == 1 else f"emg_{muscle}", standard, "volt", ("V", "mV"))
        for muscle, standard in enumerate(EMG_CHANNELS, start=1)
    ),
)
BY_STANDARD: Mapping[str, Quantity] = {one.standard: one for one in QUANTITIES}

_WORDS: Mapping[str, str] = {
    "time": "time times t zeit temps tempo tiempo timestamp timestamps secs uhrzeit "
    "zeitstempel heure horodatage ora hora clock tijd tijdstip",
    "torque": "torque moment drehmoment couple coppia momento par trq tau mx my mz m "
    "torques moments koppel",
    "force": "force kraft forza fuerza kracht fx fy fz f",
    "angle": "angle ang winkel position pos angolo posizione angulo posicion theta phi alpha q "
    "stellung auslenkung flexion flessione "
    "angles hoek positie",
    "velocity": "velocity vel speed omega geschwindigkeit drehzahl vitesse velocita velocidad "
    "snelheid w",
    "perturbation": "perturbation perturb disturbance prbs storung stoerung stormoment "
    "stoermoment perturbazione disturbo perturbacion verstoring",
    "emg": "emg semg elektromyogramm",
    "command": "command commanded cmd setpoint target soll sollwert consigne comando mando "
    "reference desired demand demanded gewenst gewenste",
    "epoch": "trial trials block bloc bloque blocco blok run lauf segment sweep epoch epoche "
    "repetition rep wiederholung durchgang versuch essai prova ensayo poging",
    "no sample": "error err std sd sem quality status sequence flag limit request requested "
    "acceleration beschleunigung constant konstante",
}
_WORD: Mapping[str, str] = {word: kind for kind, text in _WORDS.items() for word in text.split()}
_GREEK = str.maketrans({"θ": " theta ", "φ": " phi ", "ϕ": " phi ", "α": " alpha ",
                        "ω": " omega ", "τ": " tau "})  # fmt: skip
_ENDS = (("stormoment", "perturbation"), ("geschwindigkeit", "velocity"), ("moment", "torque"),
         ("winkel", "angle"), ("kraft", "force"), ("snelheid", "velocity"),
         ("koppel", "torque"), ("hoek", "angle"), ("kracht", "force"))  # fmt: skip


def words_of(text: str) -> list[str]:
    """Return the words of a name in lower case, without accents: `WinkelGeschw.` has two."""
    plain = unicodedata.normalize("NFKD", text.translate(_GREEK))
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    plain = re.sub(r"([a-z])([A-Z])", r"\1 \2", plain)
    return re.findall(r"[a-z]+", plain.lower())


def kind_of(words: list[str]) -> str:
    """Return what words name: a quantity, ``force``, or nothing.

    Examples
    --------
    >>> kind_of(["ellbogenwinkel"]), kind_of(["prbs", "command"]), kind_of(["sample"])
    ('angle', 'perturbation', '')
    """
    kinds = {_kind(word) for word in words}
    if "no sample" in kinds:
        return ""
    if "command" in kinds and "perturbation" not in kinds:  # the robot obeys commands of both
        return "velocity_command" if "velocity" in kinds else ""
    order = ("perturbation", "emg", "velocity", "torque", "angle", "force", "time")
    return next((kind for kind in order if kind in kinds), "")


def names_epochs(name: str) -> bool:
    """Whether a column's name is that of trials, blocks or runs, and of no quantity."""
    words = words_of(name)
    return not kind_of(words) and "epoch" in map(_kind, words)


def _kind(word: str) -> str:
    if word in _WORD:
        return _WORD[word]
    if word.startswith("soll"):
        return "command"
    return next((kind for end, kind in _ENDS if word.endswith(end)), "")


def standard_of(name: str, option: str) -> str:
    """Return the stored name of a quantity that an option names in either way.

    Raises
    ------
    UserError
        If there is no such quantity.
    """
    known = {one.name: one.standard for one in QUANTITIES} | {n: n for n in BY_STANDARD}
    if name not in known:
        raise UserError(
            f"{option}: {name} is not a quantity that is read; the nearest is "
            f"{nearest(name, known)} (known are {', '.join(one.name for one in QUANTITIES)})"
        )
    return known[name]
