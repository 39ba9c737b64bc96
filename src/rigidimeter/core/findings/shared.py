"""Words that several kinds of finding have: a text names them as ``<name>``, as may those here."""

from __future__ import annotations

from collections.abc import Mapping

SHARED: Mapping[str, str] = {
    # Why torque that is not from the robot does not matter to an estimate: nothing is to be done.
    "of_subject": """-- instrument
meaning: {method} uses only the motion that the perturbation causes: J, B and K are not biased, and
    their intervals account for it.
remedy:
-- small_bias
meaning: In this loop it biases J, B and K by {share:.2g} % of half their intervals at most.
remedy:
-- in_interval
meaning: Each frequency is weighted by its noise: it biases {changes}, which the intervals include.
remedy:
<negligible>""",
    "negligible": """-- negligible
meaning: It biases {changes}: below 1 % of each and half their intervals.
remedy:""",
    "in_interval": """-- in_interval
meaning: Each frequency is weighted by its noise, and the intervals include what torque not from the
    robot does by the loop.""",
    # J, B and K as a function of something.
    "of_change": """-- answered
meaning: J, B and K are averages beside it; without it they would be {changes}.
remedy:
-- beside
meaning: J, B and K are averages beside it; whether anything linear remains cannot be tested.
remedy: <record>
-- withheld
headline: No estimate: more remains beside the change of {symbol}
meaning: <more>
remedy: <repeat>""",
    "range": "{symbol} changes from {low:.3g} ± {low_half:.2g} {size_unit} at {low_at} to "
    "{high:.3g} ± {high_half:.2g} {size_unit} at {high_at}, {value:.0f} % of its mean (at most "
    "{limit:g} %; {p}){others}.",
    # What a term that was found leaves.
    "more": "As something else follows the perturbation too ({remains}), J, B and K are unknown, "
    "and none are given.",
    "repeat": "Repeat with a stiffer coupling, a relaxed subject and no filter of the torque, or "
    "lower the upper edge of the band (--band-hz).",
    "record": "Record the perturbation, which shows what else follows it.",
    "late": "The torque is {late_ms:.3g} ± {half_ms:.2g} ms late against the motion, as behind "
    "{terms} ({p}).",
    "sample_faster": "sample the torque faster, filter it before it is sampled "
    "(estimation.torque_lowpass_hz), use a slower drive, or hold J at a known value.",
    "values_shown": "Give the values that the recording shows, per radian: --controller "
    "{shown_inertia:.3g} {shown_damping:.3g}",
    "values_used": "Give the values that were used, per radian: --controller J_C B_C, or "
    "inertia_kg_m2 and damping_nm_s_rad in [controller].",
}
