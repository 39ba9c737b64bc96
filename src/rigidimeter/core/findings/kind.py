"""A kind of finding: its unit, its default level and its templates."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, cast

from rigidimeter.core.findings.shared import SHARED

Level = Literal["note", "caution", "exclude"]

PARTS = ("headline", "measured", "meaning", "remedy")

EXAMPLE: Mapping[str, object] = {
    **{"channel": "angle_rad", "spans": "from 8 to 8.4 s and from 9.2 to 9.7 s", "start_s": 8.0},
    **{"used_s": 18.2, "length_s": 20.0, "lost_s": 11.0, "origin": "the motion"},
    **{"missed": 13, "ticks": 2000, "late": 40, "scale": 57.3, "limit_deg": 40.0},
    **{"low_hz": 0.15, "high_hz": 10.0, "own_low_hz": 0.1, "own_high_hz": 30.0},
    **{"by_angle": 0.9971, "by_velocity": 0.9314, "velocity": 94.0, "signal": "torque"},
    **{"percent": 31.0, "method": "iv", "share": 12.0, "percent_of": (-0.4, 0.31, 0.0)},
    **{"correlation": 0.21, "lag_s": 0.06, "chance": 0.14, "stiffness": 1.75, "slope": 0.346},
    **{"names": "J and B", "symbol": "K", "size": 60.0, "size_unit": "N·m/rad", "side": "small"},
    **{"half_J": 4.1, "half_B": -2.0, "half_K": 0.3, "way": "less", "error": 0.8, "of_half": 1.2},
    **{"little": 2.0, "seen": 96.0, "late_ms": 48.0, "factor": 3.0, "p": 4e-5},
    **{"terms": "friction", "sizes": "friction of 0.1 ± 0.004 N·m"},
    **{"asked": "inertia,damping,stiffness,coulomb", "shown_inertia": 0.0458},
    **{"shown_damping": 1.6, "sd_nm": 0.21, "above_nm": 0.1, "first_s": 3.0},
    **{"frequency_hz": 4.6, "amplitude_nm": 0.3, "stands_out": 12.0, "sd": 0.21},
    **{"low": 1.34, "low_half": 0.1, "high": 2.05, "high_half": 0.12, "others": ""},
    **{"low_at": "epoch 2", "high_at": "epoch 5", "trend": ", rising by 40 % over the epochs"},
    **{"reference": "OFF", "other": "DBS", "earlier": "OFF", "later": "DBS", "where": "DBS"},
    **{"cause": "tremor", "counts": "0 of 6 epochs in OFF, 5 of 6 in DBS", "without": "p = 0.31"},
    **{"first": "J", "second": "K", "high_j": 5.9e-3, "low_j": 4.5e-3, "who": "examiners A and B"},
    **{"tests": "5 tests", "of": " for 2 measures", "half_ms": 0.05, "remains": 3e-9},
    **{"which": "the recording", "lost": "DBS", "reason": "there is no such file"},
    **{"remark": "there is one day in each condition"},
}
"""What the templates show in examples, where the example of a kind has nothing else."""


@dataclass(frozen=True)
class Kind:
    """One kind of finding.

    The templates are those of `str.format`: with `value`, `limit`, `unit`, `p` (as "p = 0.01"),
    `changes` (of J, B and K, "J +3 %, B −1 %, K 0 %") and the facts of the finding. A fact
    ``variant`` names the variants whose templates take the place of these, the last one first.

    Parameters
    ----------
    name : str
        Of the check, and of its level in `[diagnostics.levels]`.
    checks : str
        What is looked at, for the documentation.
    headline : str
        At most 15 words, without a full stop.
    measured, meaning : str
        What was measured, and what that means for J, B and K; at most 60 words together.
    remedy : str
        One sentence; empty where nothing is to be done.
    unit : str
        Of value and limit.
    level : {"note", "caution", "exclude"}
        What it does unless the settings say otherwise.
    setting : str
        The key of `[diagnostics]` that sets the limit; empty where it cannot be set.
    variants : mapping
        From the name of a variant to the templates that differ.
    example : mapping
        `value`, `limit` and whatever else the templates show that is not as in `EXAMPLE`.
    examples : mapping
        From the name of a variant to what its example has otherwise.
    """

    name: str
    checks: str
    headline: str
    measured: str
    meaning: str
    remedy: str
    unit: str = "%"
    level: Level = "caution"
    setting: str = ""
    variants: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    example: Mapping[str, object] = field(default_factory=dict)
    examples: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def template(self, part: str, variant: str = "") -> str:
        """Return one of `PARTS`, as the variants have it."""
        if part == "remedy" and "negligible" in variant.split():
            return ""
        for name in reversed(variant.split()):
            if part in self.variants.get(name, {}):
                return self.variants[name][part]
        text: str = getattr(self, part)
        return text


def kinds_of(text: str) -> tuple[Kind, ...]:
    """Return the kinds of a text.

    A kind begins with ``== name | level | unit | setting`` and has ``checks:``, the four `PARTS`
    and ``example:`` (JSON); a variant begins with ``-- name`` and has the parts that differ.
    ``<name>`` is one of the `SHARED` words.
    """
    for name, words in SHARED.items():
        text = text.replace(f"<{name}>", words)
    kinds = []
    for block in text.split("\n== ")[1:]:
        (row, own), *variants = map(_section, block.split("\n-- "))
        name, level, unit, setting = (cell.strip() for cell in row.split("|"))
        examples = {one: json.loads(parts.pop("example", "{}")) for one, parts in variants}
        example = json.loads(own.pop("example", "{}"))
        kinds.append(
            Kind(
                name,
                own["checks"],
                own["headline"],
                own["measured"],
                own["meaning"],
                own["remedy"],
                unit=unit,
                level=cast(Level, level),
                setting=setting,
                variants=dict(variants),
                example=example,
                examples=examples,
            )
        )
    return tuple(kinds)


def _section(text: str) -> tuple[str, dict[str, str]]:
    """Return the first line of a section and its parts, each as one line."""
    head, *rest = re.split(rf"\n(checks|{'|'.join(PARTS)}|example):", text)
    names, words = rest[::2], (" ".join(one.split()) for one in rest[1::2])
    return head.strip(), dict(zip(names, words, strict=True))
