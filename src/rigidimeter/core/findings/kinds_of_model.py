"""Findings of the model: what the torque holds beyond J, B and K, and how it was sampled."""

from __future__ import annotations

from rigidimeter.core.findings.kind import Kind

_SAMPLE_FASTER = (
    "sample the torque faster, filter it before it is sampled (estimation.torque_lowpass_hz), use "
    "a slower drive, or hold J at a known value."
)
_INCLUDE = "Include it: rigidimeter model --terms {asked}."

MODEL_KINDS = (
    Kind(
        "lack_of_fit",
        "part of the torque's response to the perturbation not explained by J, B and K, in %, in "
        "one of three parts of the band, if significant with p < 1e-4 over all tests of a "
        "condition; see below",
        headline="{value:.2g} % of the response to the perturbation is not J, B, K",
        measured="From {low_hz:.3g} to {high_hz:.3g} Hz {value:.2g} % of the torque's response to "
        "the perturbation is not J, B and K (at most {limit:g} %; {p}). The lower half of the band "
        "gives J {half_J:+.2g} %, B {half_B:+.2g} %, K {half_K:+.2g} %.",
        meaning="Friction, a reflex, a soft cuff or a late channel is attributed to the joint.",
        remedy="Lower the upper edge of the band (--band-hz) and see whether J and B change; "
        "`rigidimeter model --compare` tries terms.",
        setting="max_lack_of_fit_percent",
        example={"value": 6.4, "limit": 2.0, "p": 3e-9, "low_hz": 10.0, "high_hz": 30.0},
    ),
    Kind(
        "band_sensitivity",
        "change of J, B or K of all epochs of a condition together in a neighbouring band, in % of "
        "it, if its probability by chance is below 0.01 over all bands and it is more than half of "
        "half the estimate's interval; see below",
        headline="{symbol} is {value:.2g} % {way} from {low_hz:.3g} to {high_hz:.3g} Hz",
        measured="From {low_hz:.3g} to {high_hz:.3g} Hz {symbol} is {value:.2g} ± {error:.2g} % "
        "{way} than from {own_low_hz:.3g} to {own_high_hz:.3g} Hz (at most {limit:g} %; {p}), "
        "{of_half:.2g} times half its interval.",
        meaning="The band decides what the estimate is, as it does where a term is missing.",
        remedy="State the band, compare J, B and K in other bands, and try terms with `rigidimeter "
        "model --compare`.",
        setting="max_band_sensitivity_percent",
        example={"value": 6.0, "limit": 3.0, "p": 1e-5, "low_hz": 0.1, "high_hz": 21.0},
    ),
    Kind(
        "between_samples",
        "largest change of J, B or K, in %, with another drive that explains the motion by the "
        "command as well, if it is more than the standard error "
        "([why](../explanation/between-samples.md)); also how far J may be too low where command "
        "or perturbation was recorded and the drive is not known, where neither was and the drive "
        "of the settings would change J by more, or where the torque holds a friction below 2 % of "
        "its SD, as a drive with friction leaves",
        headline="{symbol} may be {value:.2g} % off: motion between samples is not known",
        measured="Drives that explain the motion equally well give {symbol} up to {value:.2g} % "
        "away (at most {limit:g} %).",
        meaning="The samples do not show how the joint moved between them, so {symbol} may be as "
        "much too high or too low.",
        remedy="To settle it, " + _SAMPLE_FASTER,
        setting="max_between_samples_percent",
        variants={
            "of_settings": {
                "measured": "A drive of second order with {bandwidth_hz:g} Hz, commanded "
                "{ticks_hz:.4g} times a second, makes {symbol} {value:.2g} % wrong at the samples "
                "of the torque (at most {limit:g} %).",
                "meaning": "The command is not recorded, so that is not corrected: {symbol} may be "
                "as much too high or too low; a faster drive would make J lower still.",
                "remedy": "Record the velocity command beside angle or velocity, state the drive "
                "(rig.tick_rate_hz, rig.drive_bandwidth_hz), or " + _SAMPLE_FASTER,
            },
            "unknown_drive": {
                "headline": "J may be {low_j:.3g} to {high_j:.3g} kg·m²: the drive is not known",
                "measured": "Drives of up to {bandwidth_hz:g} Hz that the recording allows give J "
                "from {low_j:.3g} to {high_j:.3g} kg·m², up to {value:.2g} % more (at most "
                "{limit:g} %).",
                "meaning": "The torque was sampled when commands were sent, and sees less than the "
                "mean acceleration between them.",
                "remedy": "Record the velocity command at every tick, beside angle or velocity, or "
                + _SAMPLE_FASTER,
            },
            "friction": {
                "headline": "J may be some percent too small: friction of the drive",
                "measured": "The torque holds a friction below {little:g} % of its SD, as friction "
                "of the drive leaves there.",
                "meaning": "Without the command it is not known how the drive moved between the "
                "samples, and J may be some percent too small.",
                "remedy": "Record the command, or " + _SAMPLE_FASTER,
            },
            "as_sampled": {
                "headline": "J is {value:.2g} % too {side}: the torque's samples miss acceleration",
                "measured": "The torque was sampled where the acceleration is {seen:.3g} % of its "
                "mean between the samples (at most {limit:g} % away).",
                "meaning": "J is taken to be as much too {side}.",
                "remedy": "Use --method iv with the perturbation recorded, which corrects it, or "
                "sample faster.",
            },
        },
        example={
            "value": 4.0,
            "limit": 1.0,
            "symbol": "J",
            "low_j": 0.0721,
            "high_j": 0.075,
            "bandwidth_hz": 50.0,
            "ticks_hz": 1000.0,
        },
    ),
    Kind(
        "missing_term",
        "coupling compliance, friction, reflex, damping that differs between directions, cubic and "
        "quadratic stiffness: tested on the part of the torque that no linear filter of the motion "
        "explains ([why](../development/model-terms.md#why-terms-are-compared-without-their-"
        "linear-part)), adjusted by Holm's method, p < 0.001; how far J, B and K move if they are "
        "included, in % of half their intervals (100 at most)",
        headline="The torque holds {terms}: {changes}",
        measured="The torque holds {sizes} ({p}). Left out, it moves {changes}, {value:.3g} % of "
        "half their intervals (at most {limit:g} %).",
        meaning="J, B and K absorb it.",
        remedy=_INCLUDE,
        variants={
            "several": {"headline": "The torque holds {terms}", "remedy": _INCLUDE},
            "reflex": {
                "measured": "The torque holds a reflex, {size:.3g} N·m·s/rad "
                "{late_ms:.0f} ms late, {share:.0f} % of what J, B and K leave to a linear filter "
                "({p}). Left out, it moves {changes}, {value:.3g} % of half their intervals (at "
                "most {limit:g} %)."
            },
            "coupling": {
                "headline": "The coupling is compliant: {changes}",
                "measured": "The coupling of sensor and joint has a stiffness of {size:.3g} "
                "N·m/rad, {share:.0f} % of what J, B and K leave to a linear filter ({p}). It "
                "moves {changes}, {value:.3g} % of half their intervals (at most {limit:g} %).",
                "remedy": "Make the coupling stiffer, or lower the upper edge of the band "
                "(--band-hz).",
            },
            "of_drive": {
                "meaning": "Below 2 % of the torque's SD it may be friction of the drive; "
                "including it then does not help."
            },
            "within": {"meaning": "That is less than half their intervals.", "remedy": ""},
        },
        examples={"within": {"value": 34.0, "percent_of": (0.5, -0.3, 0.7)}},
        example={
            "value": 340.0,
            "limit": 100.0,
            "p": 2e-8,
            "percent_of": (5.2, -3.1, 7.0),
            "share": 96.0,
        },
    ),
    Kind(
        "differs_from_estimate",
        "by rigidimeter model: J, B and K alone, by the least squares that fits the terms, less "
        "those of rigidimeter estimate in the same band; the largest of the three, in % of half "
        "its interval",
        headline="Least squares gives {changes} against `estimate`",
        measured="J, B and K alone, fitted as the terms are, differ from `estimate` in the same "
        "band (method {method}) by {value:.3g} % of half its interval (at most {limit:g} %).",
        meaning="The fit of terms uses neither the perturbation nor the motion between samples, "
        "so all its coefficients may be as wrong.",
        remedy="Where J, B and K explain the torque, take them from `rigidimeter estimate`.",
        example={"value": 660.0, "limit": 100.0, "percent_of": (-0.84, 0.1, 0.0)},
    ),
    Kind(
        "controller_misfit",
        "difference of the recorded velocity command from what the controller of the settings "
        "makes of perturbation and torque, 0.5 to 10 Hz but for the line at which they differ "
        "most, in % of the command",
        headline="The recorded command differs by {value:.2g} % from the controller's",
        measured="From perturbation and torque the controller of the settings makes a velocity "
        "command that differs from the recorded one by {value:.2g} % (at most {limit:g} %) and is "
        "{factor:.2g} times as large.",
        meaning="What is computed of the loop is for a different controller.",
        remedy="Give the values that were used, per radian: --controller J_C B_C, or inertia_kg_m2 "
        "and damping_nm_s_rad in [controller].",
        setting="max_controller_misfit_percent",
        variants={
            "shown": {
                "remedy": "Give the values that the recording shows, per radian: --controller "
                "{shown_inertia:.3g} {shown_damping:.3g}."
            },
            "per_degree": {
                "remedy": "Give the values that the recording shows, per radian: --controller "
                "{shown_inertia:.3g} {shown_damping:.3g}; those of the settings seem to be per "
                "degree."
            },
            "per_degree_twice": {
                "remedy": "Give the values that the recording shows, per radian: --controller "
                "{shown_inertia:.3g} {shown_damping:.3g}; those of the settings seem to be "
                "multiplied by 57.3."
            },
            "instrument": {"meaning": "{method} is less precise with it, not biased."},
            "in_interval": {
                "meaning": "Each frequency is weighted by its noise, and the intervals include "
                "what torque not from the robot does by the loop."
            },
            "small_bias": {
                "meaning": "By the loop that the recording shows, torque not from the robot biases "
                "J, B and K by {share:.2g} % of half their intervals at most."
            },
        },
        example={"value": 50.0, "limit": 20.0, "factor": 0.5},
    ),
    Kind(
        "unstable_loop",
        "growth of the slowest motion of the loop of the settings with the joint that was found, "
        "per second",
        headline="This controller would be unstable with this joint",
        measured="With the controller of the settings and this joint the loop's slowest motion "
        "grows by a factor of e^({value:.2g}) a second (at most 1).",
        meaning="The joint or the controller was a different one.",
        remedy="Give the values that were used, per radian: --controller J_C B_C, or inertia_kg_m2 "
        "and damping_nm_s_rad in [controller].",
        unit="1/s",
        variants={
            "instrument": {
                "meaning": "{method} takes the motion that the perturbation would cause without "
                "feedback, so it is less precise, not biased."
            },
            "in_interval": {
                "meaning": "Each frequency is weighted by its noise, and the intervals include "
                "what torque not from the robot does by the loop."
            },
            "small_bias": {
                "meaning": "By the loop, torque not from the robot biases J, B and K by "
                "{share:.2g} % of half their intervals at most."
            },
        },
        example={"value": 3.1, "limit": 0.0},
    ),
)
