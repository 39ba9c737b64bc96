"""Findings of the model: what the torque holds beyond J, B and K, and how it was sampled."""

from __future__ import annotations

from rigidimeter.core.findings.kind import kinds_of

MODEL_KINDS = kinds_of("""
== lack_of_fit | caution | % | max_lack_of_fit_percent
checks: part of the torque's response to the perturbation that is neither J, B and K nor a term that
    was found, in %, by free factors of that response in ten parts of the band, if p < 0.001; see
    below
headline: {value:.2g} % of the response to the perturbation is not J, B, K
measured: From {low_hz:.3g} to {high_hz:.3g} Hz {value:.2g} % of the torque's response to the
    perturbation is neither J, B and K nor a known term (at most {limit:g} %; {p}). More weight for
    low frequencies moves J {half_J:+.2g} %, B {half_B:+.2g} %, K {half_K:+.2g} %.
meaning: J, B and K absorb part of it.
remedy: Lower the upper edge of the band (--band-hz) and see whether J and B change; `rigidimeter
    model --compare` tries terms.
example: {"value": 6.4, "limit": 2.0, "p": 3e-09, "low_hz": 0.15, "high_hz": 30.0}
-- answered
meaning: That is below 1 % of each, and the intervals include it.
remedy:
example: {"value": 2.6, "half_J": 0.4, "half_B": -0.2, "half_K": 0.1}
-- motion
headline: {value:.2g} % of the torque that goes with the motion is not J, B, K
measured: From {low_hz:.3g} to {high_hz:.3g} Hz {value:.2g} % of the torque that goes with the
    motion is not J, B and K (at most {limit:g} %; {p}).
meaning: A term is missing, or the subject answers the motion; J, B and K absorb part of it.
remedy: Record the perturbation and use --method iv.
-- withheld
headline: No estimate: {value:.2g} % of the response to the perturbation is unexplained
meaning: J, B and K depend on the frequencies that count, so none are given.
remedy: <repeat>

== band_sensitivity | caution | % | max_band_sensitivity_percent
checks: change of J, B or K of all epochs of a condition together in a neighbouring band, in % of
    it, if its probability by chance is below 0.01 over all bands and it is more than half of half
    the estimate's interval; see below
headline: {symbol} is {value:.2g} % {way} from {low_hz:.3g} to {high_hz:.3g} Hz
measured: From {low_hz:.3g} to {high_hz:.3g} Hz {symbol} is {value:.2g} ± {error:.2g} % {way} than
    from {own_low_hz:.3g} to {own_high_hz:.3g} Hz (at most {limit:g} %; {p}), {of_half:.2g} times
    half its interval.
meaning: The band decides what the estimate is, as it does where a term is missing.
remedy: State the band, compare J, B and K in other bands, and try terms with `rigidimeter model
    --compare`.
example: {"value": 6.0, "limit": 3.0, "p": 1e-05, "low_hz": 0.1, "high_hz": 21.0}

== between_samples | caution | % | max_between_samples_percent
checks: largest change of J, B or K, in %, with another drive that explains the motion by the
    command as well, if it is more than the standard error
    ([why](../explanation/between-samples.md)); also how far J may be too low where command or
    perturbation was recorded and the drive is not known, where neither was and the drive of the
    settings would change J by more, or where the torque holds a little friction, as a drive with
    friction leaves
headline: {symbol} may be {value:.2g} % off: motion between samples is not known
measured: Drives that explain the motion equally well give {symbol} up to {value:.2g} % away (at
    most {limit:g} %).
meaning: The samples do not show how the joint moved between them, so {symbol} may be as much too
    high or too low.
remedy: To settle it, <sample_faster>
example: {"value": 4.0, "limit": 1.0, "symbol": "J", "low_j": 0.0721, "high_j": 0.075,
    "bandwidth_hz": 50.0, "ticks_hz": 1000.0}
-- of_settings
measured: A drive of second order with {bandwidth_hz:g} Hz, commanded {ticks_hz:.4g} times a second,
    makes {symbol} {value:.2g} % wrong at the samples of the torque (at most {limit:g} %).
meaning: The command is not recorded, so that is not corrected: {symbol} may be as much too high or
    too low; a faster drive would make J lower still.
remedy: Record the velocity command beside angle or velocity, state the drive (rig.tick_rate_hz,
    rig.drive_bandwidth_hz), or <sample_faster>
-- unknown_drive
headline: J may be {low_j:.3g} to {high_j:.3g} kg·m²: the drive is not known
measured: Drives of up to {bandwidth_hz:g} Hz that the recording allows give J from {low_j:.3g} to
    {high_j:.3g} kg·m², up to {value:.2g} % more (at most {limit:g} %).
meaning: The torque was sampled when commands were sent, and sees less than the mean acceleration
    between them.
remedy: Record the velocity command at every tick, beside angle or velocity, or <sample_faster>
-- friction
headline: J may be some percent too small: friction of the drive
measured: The torque holds a friction below 2 % of what J, B and K take, as friction of the drive
    leaves there.
meaning: Without the command it is not known how the drive moved between the samples, and J may be
    some percent too small.
remedy: Record the command, or <sample_faster>
-- as_sampled
headline: J is {value:.2g} % too {side}: the torque's samples miss acceleration
measured: The torque was sampled where the acceleration is {seen:.3g} % of its mean between the
    samples (at most {limit:g} % away).
meaning: J is taken to be as much too {side}.
remedy: Use --method iv with the perturbation recorded, which corrects it, or sample faster.

== missing_term | caution | % |
checks: friction, damping or stiffness that differs between directions, a reflex (not where
    `subject_present` is false), a soft coupling: [tested
    together](../explanation/algebra-of-estimation.md#6-one-test-of-what-else-is-there) with all
    that varies, adjusted by Holm's method, p < 0.001, if it is 2 % of the torque's response (a
    coupling: if it gives 0.2 % of what the joint does); how far J, B and K move without it, in % of
    half their intervals
headline: The torque holds {terms}: {changes}
measured: The torque holds {sizes} ({p}).
meaning: Left out, it moves {changes}, {value:.3g} % of half their intervals (at most {limit:g} %).
    J, B and K absorb it.
remedy: Include it: rigidimeter model --terms {asked}.
example: {"value": 340.0, "limit": 100.0, "p": 2e-08, "percent_of": [5.2, -3.1, 7.0]}
-- several
headline: The torque holds {terms}
meaning: Left out, they move {changes}, {value:.3g} % of half their intervals (at most {limit:g} %).
    J, B and K absorb them.
remedy: Include them: rigidimeter model --terms {asked}.
example: {"terms": "friction and a reflex", "sizes": "friction of 0.1 ± 0.004 N·m and a reflex of
    0.21 ± 0.02 N·m·s/rad 48 ms late", "asked": "inertia,damping,stiffness,coulomb,reflex+"}
-- coupling
headline: The coupling is compliant: {changes}
measured: The coupling of sensor and joint has a stiffness of {size:.3g} N·m/rad, of which K is
    {share:.2g} % ({p}).
remedy: Make the coupling stiffer, or lower the upper edge of the band (--band-hz).
example: {"terms": "a soft coupling", "share": 2.5}
-- answered
headline: J, B and K are those beside {terms}
meaning: J, B and K are those beside that; without it they would be {changes}.
remedy:
-- beside
headline: The torque holds {terms}, and perhaps more
meaning: J, B and K are those beside that; without it they would be {changes}. Whether anything
    linear remains cannot be tested.
remedy: <record>
-- withheld
headline: No estimate: the torque holds more than {terms}
meaning: <more>
remedy: <repeat>

== controller_misfit | caution | % | max_controller_misfit_percent
checks: difference of the recorded velocity command from what the controller of the settings makes
    of perturbation and torque, 0.5 to 10 Hz but for the line at which they differ most, in % of the
    command
headline: The recorded command differs by {value:.2g} % from the controller's
measured: From perturbation and torque the controller of the settings makes a velocity command that
    differs from the recorded one by {value:.2g} % (at most {limit:g} %) and is {factor:.2g} times
    as large.
meaning: What is computed of the loop is for a different controller.
remedy: <values_used>
example: {"value": 50.0, "limit": 20.0, "factor": 0.5}
-- shown
remedy: <values_shown>.
-- per_degree
remedy: <values_shown>; those of the settings seem to be per degree.
-- per_degree_twice
remedy: <values_shown>; those of the settings seem to be multiplied by 57.3.
-- instrument
meaning: {method} is less precise with it, not biased.
<in_interval>
-- small_bias
meaning: By the loop that the recording shows, torque not from the robot biases J, B and K by
    {share:.2g} % of half their intervals at most.

== unstable_loop | caution | 1/s |
checks: growth of the slowest motion of the loop of the settings with the joint that was found, per
    second
headline: This controller would be unstable with this joint
measured: With the controller of the settings and this joint the loop's slowest motion grows by a
    factor of e^({value:.2g}) a second (at most 1).
meaning: The joint or the controller was a different one.
remedy: <values_used>
example: {"value": 3.1, "limit": 0.0}
-- instrument
meaning: {method} takes the motion that the perturbation would cause without feedback, so it is less
    precise, not biased.
<in_interval>
-- small_bias
meaning: By the loop, torque not from the robot biases J, B and K by {share:.2g} % of half their
    intervals at most.
""")
