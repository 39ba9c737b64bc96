"""The sources that the methods paragraphs cite."""

from __future__ import annotations

from typing import NamedTuple


class Reference(NamedTuple):
    """How a text names a source, and where it is to be found."""

    short: str
    full: str


REFERENCES = {
    "paper": Reference(
        "Werning et al. 2022",
        "Werning A, Umbarila D, Fite M, Fergus S, Zhang J, Molnar GF, Johnson LA, Wang J, Vitek "
        "JL, Escobar Sanabria D. Quantifying viscous damping and stiffness in parkinsonism using "
        "data-driven model estimation and admittance control. ASME Journal of Medical Devices "
        "16(4), 041004, 2022.",
    ),
    "riv": Reference(
        "Young and Jakeman 1979",
        "Young P, Jakeman A. Refined instrumental variable methods of recursive time-series "
        "analysis. Part I. Single input, single output systems. International Journal of Control "
        "29(1), 1–30, 1979.",
    ),
    "riv_loop": Reference(
        "Gilson et al. 2011",
        "Gilson M, Garnier H, Young P, Van den Hof P. Optimal instrumental variable method for "
        "closed-loop identification. IET Control Theory and Applications 5(10), 1147–1154, 2011.",
    ),
    "hodges": Reference(
        "Hodges and Lehmann 1963",
        "Hodges JL, Lehmann EL. Estimates of location based on rank tests. Annals of Mathematical "
        "Statistics 34(2), 598–611, 1963.",
    ),
    "kenward": Reference(
        "Kenward and Roger 1997",
        "Kenward MG, Roger JH. Small sample inference for fixed effects from restricted maximum "
        "likelihood. Biometrics 53(3), 983–997, 1997.",
    ),
    "satterthwaite": Reference(
        "Satterthwaite 1946",
        "Satterthwaite FE. An approximate distribution of estimates of variance components. "
        "Biometrics Bulletin 2(6), 110–114, 1946.",
    ),
    "bca": Reference(
        "Efron 1987",
        "Efron B. Better bootstrap confidence intervals. Journal of the American Statistical "
        "Association 82(397), 171–185, 1987.",
    ),
    "newcombe": Reference(
        "Newcombe 2006",
        "Newcombe RG. Confidence intervals for an effect size measure based on the Mann–Whitney "
        "statistic. Part 2: asymptotic methods and evaluation. Statistics in Medicine 25(4), "
        "559–573, 2006.",
    ),
    "holm": Reference(
        "Holm 1979",
        "Holm S. A simple sequentially rejective multiple test procedure. Scandinavian Journal of "
        "Statistics 6(2), 65–70, 1979.",
    ),
}


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
        self.found: dict[str, Reference] = {}

    def __call__(self, *keys: str) -> str:
        """Return ``(A 1990; B 2000)`` and remember them."""
        self.found |= {key: REFERENCES[key] for key in keys if key not in self.found}
        return f"({'; '.join(REFERENCES[key].short for key in keys)})"

    def by_name(self, key: str) -> str:
        """Return ``A (1990)`` and remember it."""
        self(key)
        names, _, year = REFERENCES[key].short.rpartition(" ")
        return f"{names} ({year})"
