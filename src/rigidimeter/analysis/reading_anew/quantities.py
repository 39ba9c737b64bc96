"""The quantities that a recording may hold, and the words for them in six languages.

A quantity is found in the name of a column by its words, as in `Torque`, `Drehmoment [Nm]` or
`vitesse angulaire (deg/s)`: English, German, French, Italian, Spanish and Dutch.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from typing import NamedTuple

from rigidimeter.core.records import EMG_CHANNELS


class Quantity(NamedTuple):
    """A quantity with the name under which it is stored.

    Attributes
    ----------
    name : str
        As options call it, such as ``torque``.
    stored : str
        The channel, with its unit, such as ``torque_nm``.
    usual : tuple of str
        The units in which files mostly have it, the stored one first.
    confused : str
        The unit with which the stored one is confused, and a factor of 57 or 1000 apart.
    """

    name: str
    stored: str
    usual: tuple[str, ...]
    confused: str = ""


QUANTITIES: Mapping[str, Quantity] = {
    one.name: one
    for one in (
        Quantity("time", "time_s", ("s", "ms")),
        Quantity("torque", "torque_nm", ("Nm",), "Nmm"),
        Quantity("angle", "angle_rad", ("rad", "deg"), "deg"),
        Quantity("velocity", "velocity_rad_s", ("rad/s", "deg/s"), "deg/s"),
        Quantity("velocity_command", "velocity_command_rad_s", ("rad/s", "deg/s")),
        Quantity("perturbation", "perturbation_nm", ("Nm",)),
        *(
            Quantity("emg" if muscle == 1 else f"emg_{muscle}", stored, ("V", "mV"))
            for muscle, stored in enumerate(EMG_CHANNELS, start=1)
        ),
    )
}
BY_STORED: Mapping[str, Quantity] = {one.stored: one for one in QUANTITIES.values()}
MOTION = ("angle", "velocity")
"""What an estimate needs one of, beside the torque; the first that there is counts."""
EMG = tuple(BY_STORED[stored].name for stored in EMG_CHANNELS)
LABELS = ("epoch", "condition", "task")

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
    kinds = {_of_word(word) for word in words}
    if "no sample" in kinds:
        return ""
    if "command" in kinds and "perturbation" not in kinds:  # the robot obeys commands of both
        return "velocity_command" if "velocity" in kinds else ""
    order = ("perturbation", "emg", "velocity", "torque", "angle", "force", "time")
    return next((kind for kind in order if kind in kinds), "")


def names_epochs(name: str) -> bool:
    """Whether a column's name is that of trials, blocks or runs, and of no quantity."""
    words = words_of(name)
    return not kind_of(words) and "epoch" in map(_of_word, words)


def _of_word(word: str) -> str:
    if word in _WORD:
        return _WORD[word]
    if word.startswith("soll"):
        return "command"
    return next((kind for end, kind in _ENDS if word.endswith(end)), "")
