"""Findings of the sensors, the loop and the drive: was the motion measured as it was designed."""

from __future__ import annotations

from rigidimeter.core.findings.kind import Kind

_REST_USED = "That part is left out; J, B and K are from {used_s:.3g} of {length_s:.3g} s."

SENSOR_KINDS = (
    Kind(
        "computed_torque",
        "RMS of what of the torque is no weighted sum of samples (from two before to two after) of "
        "the motion or of the perturbation, in % of the torque's SD; not for simulated sessions",
        headline="The torque was computed from {origin}, not measured",
        measured="Only {value:.2g} % of the torque's SD is not a weighted sum of samples of "
        "{origin} (at least {limit:g} %).",
        meaning="The torque was computed from {origin}, or simulated without noise, so J, B and K "
        "are those of the formula.",
        remedy="Record what the torque sensor measured; for a simulation set computed_torque to "
        "note in [diagnostics.levels].",
        level="exclude",
        setting="min_computed_torque_percent",
        example={"value": 2e-9, "limit": 0.001},
    ),
    Kind(
        "saturation",
        "share of samples in which torque or motion repeats its extreme value, three times or more "
        "in a row",
        headline="{channel} repeats its extreme value in {value:.2g} % of samples",
        measured="{channel} repeats its largest or smallest value in {value:.2g} % of the samples "
        "(at most {limit:g} %).",
        meaning="The sensor or its amplifier was at the end of its range, so a part of the signal "
        "is missing and J, B and K are wrong.",
        remedy="Choose a larger range or a smaller perturbation, and repeat.",
        level="exclude",
        setting="max_saturated_percent",
        variants={
            "left_out": {
                "headline": "{channel} was at the end of its range; that part is left out",
                "measured": "{channel} repeats an extreme value in {value:.2g} % of the time (at "
                "most {limit:g} %), {spans}.",
                "meaning": _REST_USED,
            }
        },
        example={"value": 2.3, "limit": 0.5},
    ),
    Kind(
        "frozen",
        "longest time for which torque or motion repeats one value that the recorded command does "
        "not explain (rest, or for the velocity a constant one); at most `max_left_out_percent` of "
        "an epoch is left out for it or for saturation",
        headline="{channel} repeats one value for {value:.2g} s",
        measured="{channel} repeats one value for {value:.2g} s (at most {limit:g} s), from "
        "{start_s:.4g} s on.",
        meaning="The sensor stopped, or the joint was held, so J, B and K are wrong.",
        remedy="Check the sensor's cable and its rate.",
        level="exclude",
        unit="s",
        setting="max_frozen_s",
        variants={
            "left_out": {
                "headline": "{channel} stopped for {value:.2g} s; that part is left out",
                "measured": "{channel} repeats one value for {value:.2g} s (at most {limit:g} s), "
                "and is left out {spans}.",
                "meaning": "J, B and K are from {used_s:.3g} of {length_s:.3g} s.",
            }
        },
        example={"value": 0.4, "limit": 0.1},
    ),
    Kind(
        "left_out",
        "time that was left out by hand (without the trimmed second on each side), in s; the "
        "details have the reason",
        headline="{value:.3g} s were left out by hand",
        measured="{value:.3g} s were left out by hand, {spans}: {reason}.",
        meaning="J, B and K are from {used_s:.3g} of {length_s:.3g} s.",
        remedy="Compare the estimate with that of the complete epoch.",
        level="note",
        unit="s",
        example={"value": 0.9, "limit": 0.0, "reason": "a cable was pulled"},
    ),
    Kind(
        "lost_samples",
        "share of the epoch's time whose samples are lost because `samples.arrows` is damaged or "
        "cut off, in %",
        headline="{value:.2g} % of the epoch's samples are lost",
        measured="Samples of {lost_s:.3g} s are lost, {value:.2g} % of the epoch (at most "
        "{limit:g} %): {reason}.",
        meaning="What is left is another experiment than was planned.",
        remedy="Read an undamaged copy of the recording, and test the disk that it was on.",
        level="exclude",
        setting="max_left_out_percent",
        variants={
            "left_out": {
                "meaning": "The gap is left out, {spans}; J, B and K are from {used_s:.3g} of "
                "{length_s:.3g} s."
            }
        },
        example={"value": 55.0, "limit": 50.0, "reason": "batch 7 of samples.arrows is damaged"},
        examples={"left_out": {"value": 9.1, "lost_s": 1.8}},
    ),
    Kind(
        "missed_ticks",
        "share of the ticks due at which the loop never ran, in %; the details have the late ticks "
        "as well",
        headline="{missed} of {ticks} ticks of the loop never ran",
        measured="{missed} of {ticks} ticks that were due never ran ({value:.2g} %, at most "
        "{limit:g} %), and {late} were late.",
        meaning="The drive held its command there, and how the joint then moved between the "
        "samples is not known: J may be wrong.",
        remedy="Give the loop a processor of its own with `--cpu N`, close other programs, or "
        "lower rig.tick_rate_hz.",
        setting="max_missed_ticks_percent",
        variants={
            "followed": {
                "meaning": "The drive held its command there and the estimate allows for that: J, "
                "B and K stay within their intervals.",
                "remedy": "",
            }
        },
        example={"value": 0.65, "limit": 0.1},
    ),
    Kind(
        "velocity_scale",
        "ratio of the change of angle to the integrated velocity, minus 1, in %",
        headline="The angle changes {scale:.3g} times as much as the velocity states",
        measured="angle_rad changes {scale:.3g} times as much as velocity_rad_s states, "
        "{value:.2g} % from 1 (at most {limit:g} %).",
        meaning="One of them has another unit or sign, or is another joint's, so J, B and K are "
        "wrong.",
        remedy="Check the units and signs of both channels.",
        level="exclude",
        setting="max_velocity_scale_percent",
        example={"value": 5630.0, "limit": 10.0},
    ),
    Kind(
        "velocity_delay",
        "delay τ of velocity relative to angle, in ms; a shorter one too that moves B, by K τ, by "
        "more than half its interval",
        headline="The velocity lags the angle by {value:.2g} ms",
        measured="velocity_rad_s lags angle_rad by {value:.2g} ms (at most {limit:.2g} ms either "
        "way).",
        meaning="A filter or a buffer moved one of them, and B and K take each other's part.",
        remedy="Correct the time stamps, or leave velocity_rad_s out: it is then made from the "
        "angle.",
        unit="ms",
        setting="max_velocity_delay_ms",
        example={"value": 12.0, "limit": 5.0},
    ),
    Kind(
        "velocity_shape",
        "rms of what of the angle's derivative the velocity, with its scale and delay fitted, does "
        "not follow, up to 10 Hz, in % of the derivative's rms; the details have R² of the torque "
        "with either",
        headline="Velocity and derivative of the angle differ in shape by {value:.2g} %",
        measured="From {low_hz:g} to {high_hz:.3g} Hz velocity_rad_s and the derivative of "
        "angle_rad differ by {value:.2g} % of its rms (at most {limit:g} %). R² of the torque is "
        "{by_angle:.4g} with the angle alone and {by_velocity:.4g} with the velocity alone.",
        meaning="That does not tell which of them is wrong; J, B and K may be.",
        remedy="Compare the estimates without the one and without the other channel.",
        setting="max_velocity_shape_percent",
        variants={
            "velocity": {
                "meaning": "So the velocity is wrong, and J and B are made from it.",
                "remedy": "Leave velocity_rad_s out: it is then made from the angle.",
            },
            "angle": {
                "meaning": "So the angle is wrong, and K is made from it.",
                "remedy": "Leave angle_rad out: it is then made from the velocity.",
            },
        },
        example={"value": 9.3, "limit": 5.0},
    ),
    Kind(
        "torque_delay",
        "delay of the torque against the motion that was found and not corrected, in ms, where the "
        "perturbation was not recorded and a move of the torque by it changes J, B or K by more "
        "than half their intervals, which hold a delay up to half a tick where no drive was "
        "identified either",
        headline="Torque is {late_ms:.3g} ms late: {changes}",
        measured="The torque is {late_ms:.3g} ms late against the motion (at most {limit:.2g} ms "
        "either way), which was not corrected.",
        meaning="If it is a delay, it moves {changes}; if not, a reflex is in J and B, or "
        "voluntary torque.",
        remedy="Record the perturbation, which tells the two apart, or take a known delay out of "
        "the recording.",
        unit="ms",
        example={"value": 4.0, "limit": 1.2, "late_ms": 4.0, "percent_of": (-12.0, -5.1, 0.0)},
    ),
    Kind(
        "guard_limited",
        "share of the commands that the guard changed",
        headline="The guard changed {value:.2g} % of the commands",
        measured="The guard changed {value:.2g} % of the commands (at most {limit:g} %).",
        meaning="The arm did not follow the perturbation as designed, so J, B and K are less "
        "precise, and their intervals may be wrong.",
        remedy="Use a smaller perturbation or wider limits in [guard].",
        setting="max_limited_percent",
        example={"value": 4.2, "limit": 1.0},
    ),
    Kind(
        "position_limit",
        "farthest angle, in % of the position limit",
        headline="The joint came to {value:.0f} % of the position limit",
        measured="The joint came to {value:.0f} % of the position limit of {limit_deg:.3g}° (at "
        "most {limit:g} %).",
        meaning="It was held back there, which the fit takes for stiffness: K may be too high.",
        remedy="Use a smaller perturbation, or begin nearer to the middle of the range.",
        setting="max_position_percent",
        example={"value": 99.0, "limit": 98.0},
    ),
)
