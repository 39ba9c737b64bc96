"""Findings of the sensors, the loop and the drive: was the motion measured as it was designed."""

from __future__ import annotations

from rigidimeter.core.findings.kind import kinds_of

SENSOR_KINDS = kinds_of("""
== computed_torque | exclude | % | min_computed_torque_percent
checks: RMS of what of the torque is no weighted sum of samples (from two before to two after) of
    the motion or of the perturbation, in % of the torque's SD; not for simulated sessions
headline: The torque was computed from {origin}, not measured
measured: Only {value:.2g} % of the torque's SD is not a weighted sum of samples of {origin} (at
    least {limit:g} %).
meaning: The torque was computed from {origin}, or simulated without noise, so J, B and K are those
    of the formula.
remedy: Record what the torque sensor measured; for a simulation set computed_torque to note in
    [diagnostics.levels].
example: {"value": 2e-09, "limit": 0.001}

== saturation | exclude | % | max_saturated_percent
checks: share of samples in which torque or motion repeats its extreme value, three times or more in
    a row
headline: {channel} repeats its extreme value in {value:.2g} % of samples
measured: {channel} repeats its largest or smallest value in {value:.2g} % of the samples (at most
    {limit:g} %).
meaning: The sensor or its amplifier was at the end of its range, so a part of the signal is missing
    and J, B and K are wrong.
remedy: Choose a larger range or a smaller perturbation, and repeat.
example: {"value": 2.3, "limit": 0.5}
-- left_out
headline: {channel} was at the end of its range; that part is left out
measured: {channel} repeats an extreme value in {value:.2g} % of the time (at most {limit:g} %),
    {spans}.
meaning: That part is left out; J, B and K are from {used_s:.3g} of {length_s:.3g} s.

== frozen | exclude | s | max_frozen_s
checks: longest time for which torque or motion repeats one value that the recorded command does not
    explain (rest, or for the velocity a constant one); at most `max_left_out_percent` of an epoch
    is left out for it or for saturation
headline: {channel} repeats one value for {value:.2g} s
measured: {channel} repeats one value for {value:.2g} s (at most {limit:g} s), from {start_s:.4g} s
    on.
meaning: The sensor stopped, or the joint was held, so J, B and K are wrong.
remedy: Check the sensor's cable and its rate.
example: {"value": 0.4, "limit": 0.1}
-- left_out
headline: {channel} stopped for {value:.2g} s; that part is left out
measured: {channel} repeats one value for {value:.2g} s (at most {limit:g} s), and is left out
    {spans}.
meaning: J, B and K are from {used_s:.3g} of {length_s:.3g} s.

== left_out | note | s |
checks: time that was left out by hand (without the trimmed second on each side), in s; the details
    have the reason
headline: {value:.3g} s were left out by hand
measured: {value:.3g} s were left out by hand, {spans}: {reason}.
meaning: J, B and K are from {used_s:.3g} of {length_s:.3g} s.
remedy: Compare the estimate with that of the complete epoch.
example: {"value": 0.9, "limit": 0.0, "reason": "a cable was pulled"}

== lost_samples | exclude | % | max_left_out_percent
checks: share of the epoch's time whose samples are lost because `samples.arrows` is damaged or cut
    off, in %
headline: {value:.2g} % of the epoch's samples are lost
measured: Samples of {lost_s:.3g} s are lost, {value:.2g} % of the epoch (at most {limit:g} %):
    {reason}.
meaning: What is left is another experiment than was planned.
remedy: Read an undamaged copy of the recording, and test the disk that it was on.
example: {"value": 55.0, "limit": 50.0, "reason": "batch 7 of samples.arrows is damaged"}
-- left_out
meaning: The gap is left out, {spans}; J, B and K are from {used_s:.3g} of {length_s:.3g} s.
example: {"value": 9.1, "lost_s": 1.8}

== missed_ticks | caution | % | max_missed_ticks_percent
checks: share of the ticks due at which the loop never ran, in %; the details have the late ticks as
    well
headline: {missed} of {ticks} ticks of the loop never ran
measured: {missed} of {ticks} ticks that were due never ran ({value:.2g} %, at most {limit:g} %),
    and {late} were late.
meaning: The drive held its command there, and how the joint then moved between the samples is not
    known: J may be wrong.
remedy: Give the loop a processor of its own with `--cpu N`, close other programs, or lower
    rig.tick_rate_hz.
example: {"value": 0.65, "limit": 0.1}
-- followed
meaning: The drive held its command there and the estimate allows for that: J, B and K stay within
    their intervals.
remedy:

== velocity_scale | exclude | % | max_velocity_scale_percent
checks: ratio of the change of angle to the integrated velocity, minus 1, in %
headline: The angle changes {scale:.3g} times as much as the velocity states
measured: angle_rad changes {scale:.3g} times as much as velocity_rad_s states, {value:.2g} % from 1
    (at most {limit:g} %).
meaning: One of them has another unit or sign, or is another joint's, so J, B and K are wrong.
remedy: Check the units and signs of both channels.
example: {"value": 5630.0, "limit": 10.0}

== velocity_delay | caution | ms | max_velocity_delay_ms
checks: delay τ of velocity relative to angle, in ms; a shorter one too that moves B, by K τ, by
    more than half its interval
headline: The velocity lags the angle by {value:.2g} ms
measured: velocity_rad_s lags angle_rad by {value:.2g} ms (at most {limit:.2g} ms either way).
meaning: A filter or a buffer moved one of them, and B and K take each other's part.
remedy: Correct the time stamps, or leave velocity_rad_s out: it is then made from the angle.
example: {"value": 12.0, "limit": 5.0}

== velocity_shape | caution | % | max_velocity_shape_percent
checks: rms of what of the angle's derivative the velocity, with its scale and delay fitted, does
    not follow, up to 10 Hz, in % of the derivative's rms; the details have R² of the torque with
    either
headline: Velocity and derivative of the angle differ in shape by {value:.2g} %
measured: From {low_hz:g} to {high_hz:.3g} Hz velocity_rad_s and the derivative of angle_rad differ
    by {value:.2g} % of its rms (at most {limit:g} %). R² of the torque is {by_angle:.4g} with the
    angle alone and {by_velocity:.4g} with the velocity alone.
meaning: That does not tell which of them is wrong; J, B and K may be.
remedy: Compare the estimates without the one and without the other channel.
example: {"value": 9.3, "limit": 5.0}
-- velocity
meaning: So the velocity is wrong, and J and B are made from it.
remedy: Leave velocity_rad_s out: it is then made from the angle.
-- angle
meaning: So the angle is wrong, and K is made from it.
remedy: Leave angle_rad out: it is then made from the velocity.

== torque_delay | caution | ms |
checks: delay of the torque against the motion, in ms: found as a term is; or not corrected,
    where the perturbation was not recorded and a move of the torque by it changes J, B or K by more
    than half their intervals, which hold a delay up to half a tick where no drive was identified
    either
headline: Torque is {late_ms:.3g} ms late: {changes}
measured: The torque is {late_ms:.3g} ms late against the motion (at most {limit:.2g} ms either
    way), which was not corrected.
meaning: If it is a delay, it moves {changes}; if not, a reflex is in J and B, or voluntary torque.
remedy: Record the perturbation, which tells the two apart, or take a known delay out of the
    recording.
example: {"value": 4.0, "limit": 1.2, "late_ms": 4.0, "percent_of": [-12.0, -5.1, 0.0], "terms": "a
    delay"}
-- answered
headline: Torque is {late_ms:.3g} ms late, and J, B and K allow for it
measured: <late>
meaning: J, B and K are those without that delay; with it they would be {changes}.
remedy:
-- beside
headline: Torque is {late_ms:.3g} ms late, and J, B and K allow for it
measured: <late>
meaning: J, B and K are those without that delay; with it they would be {changes}. Whether anything
    linear remains cannot be tested.
remedy: <record>
-- withheld
headline: No estimate: torque is {late_ms:.3g} ms late, and more remains
measured: <late>
meaning: <more>
remedy: <repeat>

== guard_limited | caution | % | max_limited_percent
checks: share of the commands that the guard changed
headline: The guard changed {value:.2g} % of the commands
measured: The guard changed {value:.2g} % of the commands (at most {limit:g} %).
meaning: The arm did not follow the perturbation as designed, so J, B and K are less precise, and
    their intervals may be wrong.
remedy: Use a smaller perturbation or wider limits in [guard].
example: {"value": 4.2, "limit": 1.0}

== position_limit | caution | % | max_position_percent
checks: farthest angle, in % of the position limit
headline: The joint came to {value:.0f} % of the position limit
measured: The joint came to {value:.0f} % of the position limit of {limit_deg:.3g}° (at most
    {limit:g} %).
meaning: It was held back there, which the fit takes for stiffness: K may be too high.
remedy: Use a smaller perturbation, or begin nearer to the middle of the range.
example: {"value": 99.0, "limit": 98.0}
""")
