"""Findings of the subject: who moved the joint, and whether it stayed the same."""

from __future__ import annotations

from rigidimeter.core.findings.kind import kinds_of

JOINT_KINDS = kinds_of("""
== loop_bias | caution | % | max_loop_bias_percent
checks: bias of least squares from torque of the subject that comes back as motion by the loop,
    computed from the recording; the largest of J, B and K, in % of half the interval. Above 56 % an
    interval for 95 % holds the truth in less than 80 %
headline: Torque not from the robot biases {changes}
measured: Torque not explained by J, B and K, which the loop turns into motion, moves {changes},
    {value:.2g} % of half their intervals at most (at most {limit:g} %).
meaning: Least squares attributes it to the joint, and the intervals do not include that.
remedy: Use --method iv with the recorded perturbation, or repeat while only the robot moves the
    joint.
example: {"value": 180.0, "limit": 50.0, "percent_of": [-17.0, -16.0, -7.2]}
-- unknown
headline: Torque not from the robot biases J, B and K too far to compute
measured: No J, B and K agree with this torque in this loop.
meaning: Least squares attributes torque that is not from the robot to the joint, and how much
    cannot be computed.
-- first_order
meaning: Least squares attributes it to the joint. The intervals include it to the first order,
    which so large a bias exceeds.
<negligible>
example: {"value": 74.0, "percent_of": [-0.4, 0.31, 0.0]}
-- not_known
headline: Loop not known: a bias by it is not in the intervals
measured: Neither settings nor a recorded perturbation or command say whether the robot gives way to
    torque.
meaning: If it does, torque not from the robot biases least squares, and the intervals do not
    include that. If it does not, nothing is missing.
remedy: Where the robot gives way, add --controller J_C B_C, or use --method iv with the recorded
    perturbation.

== unweighted_fit | caution | % | max_unweighted_percent
checks: difference of least squares without weights from that in which each frequency counts by its
    noise, the bias by the loop taken off; the largest of J, B and K, beyond four standard errors
headline: Without weights {symbol} is {value:.2g} % {way}
measured: By least squares in which all frequencies count alike, {symbol} is {value:.2g} % {way}
    than where each counts by its noise (at most {limit:g} %), the bias by the loop taken off.
meaning: Noise does not do that: the torque holds more than J, B and K, and the answer depends on
    the frequencies that count.
remedy: Look for what is missing with rigidimeter model --compare, or use --method iv with the
    recorded perturbation.
example: {"value": 24.0, "limit": 10.0, "way": "lower"}

== noise_of_motion | caution | % |
checks: noise of the motion in % of the motion that decides J or B: half the difference of what even
    and odd samples give, each frequency by its weight
headline: {value:.2g} % of the motion that decides {symbol} is noise
measured: Even and odd samples of the motion differ by {value:.2g} % of what decides {symbol} (at
    most {limit:g} %).
meaning: Frequencies at which the motion is noise decide the fit.
remedy: Use a better motion sensor, a larger perturbation, or --band-hz to end the band where the
    motion ends.
example: {"value": 66.0, "limit": 50.0, "symbol": "J"}

== voluntary_torque | caution | % | max_voluntary_share_percent
checks: power of M_sub = J θ″ + B θ′ + K θ − M between `voluntary_low_hz` and `voluntary_high_hz`,
    in % of the torque's variance
headline: {value:.2g} % of the torque variance is not explained by J, B and K
measured: The torque that J, B and K do not explain has an SD of {sd_nm:.3g} N·m; from {low_hz:g} to
    {high_hz:g} Hz it is {value:.2g} % of the torque variance (at most {limit:g} %).
meaning: Least squares attributes part of it to the joint: in a closed loop J and B come out low.
remedy: Use --method iv with the recorded perturbation and pool epochs, or leave the epoch out.
example: {"value": 23.0, "limit": 15.0, "low_hz": 0.3, "high_hz": 4.0}
<of_subject>

== active_movement | caution | % | max_active_percent
checks: share of seconds in which the SD of M_sub passes `active_torque_nm` and
    `active_share_percent` of the torque's SD
headline: Voluntary torque in {value:.0f} % of the seconds
measured: The torque that J, B and K do not explain exceeds {above_nm:.2g} N·m in {value:.0f} % of
    the seconds (at most {limit:g} %), first at {first_s:.1f} s: the joint was not at rest.
meaning: Least squares attributes part of such torque to the joint.
remedy: Repeat while only the robot moves the joint, or leave these seconds out.
example: {"value": 44.0, "limit": 20.0}
<of_subject>

== emg_activity | caution | % | max_emg_active_percent
checks: share of the time in which the 6 Hz envelope of a muscle's EMG passes `emg_baseline_factor`
    times the quietest fifth of the recording for `min_burst_s`; such stretches are left out
    (`--keep-active` fits them), except of a muscle that follows the motion, and unless that takes
    more than `max_left_out_percent` of the epoch
headline: A muscle was active in {value:.0f} % of the time
measured: The EMG of {channel} shows activity in {value:.0f} % of the time (at most {limit:g} %);
    nothing is left out for it.
meaning: J, B and K are not those of a relaxed joint.
remedy: Ask the subject to relax and repeat, or leave the active part out.
example: {"value": 38.0, "limit": 20.0, "channel": "emg_v and emg_2_v", "both": "B 0.214 with them
    and 0.137 without", "why": "with 1 s on each side that would take 52 % of the epoch (at most 50
    %)"}
<of_subject>
-- left_out
headline: A muscle was active in {value:.2g} % of the time; that is left out
measured: The EMG of {channel} shows activity in {value:.2g} % of the time; what is left out is
    {spans}.
meaning: J, B and K are from {used_s:.3g} of {length_s:.3g} s; with these stretches they differ by
    less than their intervals.
remedy:
-- moved
headline: Leaving out active stretches moves J, B or K beyond its interval
measured: The EMG of {channel} shows activity in {value:.2g} % of the time; what is left out is
    {spans}. {both}.
meaning: The estimate is from {used_s:.3g} of {length_s:.3g} s.
remedy: Report both; --keep-active fits everything.
-- too_much
headline: A muscle was active in {value:.2g} % of the time, too much to leave out
measured: The EMG of {channel} shows activity in {value:.2g} % of the time; nothing is left out:
    {why}.
meaning: How far J, B and K are from those of a relaxed joint is not known.
remedy: Repeat while the subject is relaxed, or raise `diagnostics.max_left_out_percent`.
-- locked
headline: A muscle was active with the motion in {value:.2g} % of the time
measured: The EMG of {channel} shows activity in {value:.2g} % of the time, and follows the velocity
    by more than chance, as a reflex does.
meaning: It stays in: what is left out by motion biases B and K. They include the reflex.
remedy:

== tremor | caution | % | max_tremor_share_percent
checks: power of M_sub in the strongest 1 Hz between `tremor_low_hz` and `tremor_high_hz`, in % of
    the torque's variance, if it is three times that beside it; frequency and amplitude in N·m
headline: Torque oscillates at {frequency_hz:.2g} Hz with {amplitude_nm:.2g} N·m
measured: The unexplained torque has a line at {frequency_hz:.2g} Hz of {amplitude_nm:.2g} N·m
    (amplitude), {value:.2g} % of the torque's variance (at most {limit:g} %) and {stands_out:.2g}
    times what lies beside it: a tremor or another oscillation.
meaning: Least squares attributes part of it to the joint; in a closed loop J and B come out low.
remedy: Use --method iv with the recorded perturbation, or leave the epoch out.
example: {"value": 8.0, "limit": 3.0}
<of_subject>

== varying_with_time | caution | % | max_varying_percent
checks: range over the epoch of J, B or K as a smooth function of time, in % of its mean, for each
    that varies by more than chance: tested with all terms, p < 0.001
headline: {symbol} changes from {low:.3g} to {high:.3g} {size_unit} within the epoch
measured: With time <range>
meaning: The estimate is an average over a joint that changed, and its interval does not say how far
    it went.
remedy: Cut the epoch into shorter ones, or fit the part in which the joint did not change.
example: {"value": 42.0, "limit": 10.0, "low_at": "3.1 s", "high_at": "18.0 s",
    "others": "; so do J and B"}
<of_change>

== varying_with_angle | caution | % | max_varying_percent
checks: the same for K as a function of the angle, smooth or by side
headline: {symbol} changes from {low:.3g} to {high:.3g} {size_unit} with the angle
measured: With the angle <range>
meaning: The estimate is an average over a joint that changed, and its interval holds for no angle
    in particular.
remedy: To settle it, use a smaller perturbation about each angle of interest, and state the angle.
example: {"value": 42.0, "limit": 10.0, "low_at": "−6.2° from the mean", "high_at": "+5.9° from the
    mean"}
<of_change>

== varying_with_phase | caution | % | max_varying_percent
checks: the same for B or K as a function of the phase of an imposed periodic movement, which is
    found in the angle
headline: {symbol} changes from {low:.3g} to {high:.3g} {size_unit} with the movement's phase
measured: Over the cycle <range>
meaning: The estimate is an average over a joint that changed, and its interval holds for no phase
    in particular.
remedy: Estimate each phase by itself, from many cycles, or hold the joint still.
example: {"value": 42.0, "limit": 10.0, "low_at": "90°", "high_at": "270°"}
<of_change>

== varying_between_epochs | note | % | max_varying_percent
checks: range of J, B or K over the epochs of a condition, each drawn to the mean as far as its
    standard error says, in % of the mean, if they scatter by more than their errors
    (`varying_chance`); with the fit to all epochs, from three on
headline: {symbol} differs between epochs, {low:.3g} to {high:.3g} {size_unit}
measured: {symbol} changes from {low:.3g} {size_unit} in {low_at} to {high:.3g} in {high_at},
    {value:.0f} % of the mean (at most {limit:g} %; {p}), with an SD of {sd:.2g} beyond the
    errors{trend}{others}.
meaning: The estimate from all epochs is an average; the joint changed between epochs.
remedy: Compare the epochs in order, and report the scatter between them beside the mean.
example: {"value": 42.0, "limit": 10.0}
""")
