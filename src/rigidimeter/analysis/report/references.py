"""The sources that the methods paragraphs cite."""

from __future__ import annotations

import re
from typing import NamedTuple

REFERENCES = {
    "paper": "Werning A, Umbarila D, Fite M, Fergus S, Zhang J, Molnar GF, Johnson LA, Wang J, "
    "Vitek JL, Escobar Sanabria D. Quantifying viscous damping and stiffness in parkinsonism "
    "using data-driven model estimation and admittance control. ASME Journal of Medical Devices "
    "16(4), 041004, 2022.",
    "riv": "Young P, Jakeman A. Refined instrumental variable methods of recursive time-series "
    "analysis. Part I. Single input, single output systems. International Journal of Control "
    "29(1), 1–30, 1979.",
    "riv_loop": "Gilson M, Garnier H, Young P, Van den Hof P. Optimal instrumental variable "
    "method for closed-loop identification. IET Control Theory and Applications 5(10), "
    "1147–1154, 2011.",
    "hodges": "Hodges JL, Lehmann EL. Estimates of location based on rank tests. Annals of "
    "Mathematical Statistics 34(2), 598–611, 1963.",
    "kenward": "Kenward MG, Roger JH. Small sample inference for fixed effects from restricted "
    "maximum likelihood. Biometrics 53(3), 983–997, 1997.",
    "satterthwaite": "Satterthwaite FE. An approximate distribution of estimates of variance "
    "components. Biometrics Bulletin 2(6), 110–114, 1946.",
    "bca": "Efron B. Better bootstrap confidence intervals. Journal of the American Statistical "
    "Association 82(397), 171–185, 1987.",
    "newcombe": "Newcombe RG. Confidence intervals for an effect size measure based on the "
    "Mann–Whitney statistic. Part 2: asymptotic methods and evaluation. Statistics in Medicine "
    "25(4), 559–573, 2006.",
    "holm": "Holm S. A simple sequentially rejective multiple test procedure. Scandinavian "
    "Journal of Statistics 6(2), 65–70, 1979.",
}
"""Authors, title, where and in which year it was published."""


def short_reference(key: str) -> str:
    """Return how a text names a source.

    Examples
    --------
    >>> short_reference("hodges"), short_reference("holm"), short_reference("riv_loop")
    ('Hodges and Lehmann 1963', 'Holm 1979', 'Gilson et al. 2011')
    """
    full = REFERENCES[key]
    names = [re.sub(r" [A-Z]+$", "", name) for name in full.partition(". ")[0].split(", ")]
    authors = f"{names[0]} et al." if len(names) > 2 else " and ".join(names)
    return f"{authors} {full[-5:-1]}"


class Prose(NamedTuple):
    """Paragraphs, and the sources that they name."""

    paragraphs: tuple[str, ...]
    references: tuple[str, ...]

    @property
    def text(self) -> str:
        """All of it as plain text, one line a paragraph."""
        parts = list(self.paragraphs)
        if self.references:
            parts.append("\n".join(["References", *self.references]))
        return "\n\n".join(parts) + "\n"


class Cited:
    """The sources that a text names, in the order in which it names them."""

    def __init__(self) -> None:
        self.found: dict[str, str] = {}

    def __call__(self, *keys: str) -> str:
        """Return ``(A 1990; B 2000)`` and remember them."""
        self.found |= {key: REFERENCES[key] for key in keys if key not in self.found}
        return f"({'; '.join(short_reference(key) for key in keys)})"

    def by_name(self, key: str) -> str:
        """Return ``A (1990)`` and remember it."""
        self(key)
        names, _, year = short_reference(key).rpartition(" ")
        return f"{names} ({year})"
