"""Findings of the fit: can J, B and K be told apart, and do they explain the torque."""

from __future__ import annotations

from rigidimeter.core.findings.kind import kinds_of

FIT_KINDS = kinds_of("""
== conditioning | caution | 1 | max_condition_number
checks: condition number of acceleration, velocity and angle, each scaled to unit length; which two
    are indistinguishable, and the band of the motion's power
headline: The motion cannot tell {first} from {second}
measured: The condition number of the motion is {value:.3g} (at most {limit:g}): 90 % of the
    velocity's power lies between {low_hz:.2g} and {high_hz:.2g} Hz.
meaning: {first} and {second} trade against each other, so neither is known.
remedy: Use a perturbation with more frequencies, or hold J at the median of other epochs.
example: {"value": 34.0, "limit": 10.0, "low_hz": 1.8, "high_hz": 2.3}
-- at_rest
headline: The joint did not move
measured: The condition number of the motion is infinite (at most {limit:g}).
meaning: The joint did not move, so J, B and K are not in the torque.

== imposed_sinusoid | exclude | % | max_single_frequency_percent
checks: share of the angle's variance in its strongest line, where that line also holds half of the
    velocity's: steps to and fro are no sinusoid
headline: The motion is a sinusoid: one frequency holds {value:.0f} % of it
measured: The strongest line holds {value:.0f} % of the angle's variance (at most {limit:g} %) and
    {velocity:.0f} % of the velocity's.
meaning: At a single frequency J and K are one number, K − J ω², so neither is known.
remedy: Score it as an imposed sinusoid (--task sinusoid), or use a PRBS.
example: {"value": 97.0, "limit": 85.0}

== static_torque | exclude | % | min_static_torque_percent
checks: share of the torque's variance that is not a function of the angle: squared differences of
    the torque between samples sorted by angle
headline: The torque is a function of the angle alone
measured: Only {value:.2g} % of the torque's variance is not a function of the angle (at least
    {limit:g} %).
meaning: The torque was computed from the angle, or the joint moved too slowly for inertia and
    damping: J and B are not in it.
remedy: Record what the torque sensor measured, or use a faster perturbation.
example: {"value": 0.02, "limit": 0.5}

== band_share | caution | % | min_band_share_percent
checks: share of the power of torque and velocity about their means, white noise left out, that lies
    in the band of the fit or less than 0.75 spectral lines from it; the smaller. Epochs below 14 s
    cannot tell drift from the slowest part of a band that begins at 0.15 Hz
headline: Only {value:.0f} % of the {signal}'s power lies in the band
measured: Only {value:.0f} % of the {signal}'s power lies in the band, {low_hz:g} to {high_hz:.3g}
    Hz (at least {limit:g} %).
meaning: Most of what was measured lies below or above the band, so J, B and K are from a small part
    of it.
remedy: Look for drift and slow pushes, check rate and unit of the time, and set the band to what
    was perturbed (--band-hz).
example: {"value": 21.0, "limit": 50.0}

== coherence | caution | 1 | min_coherence
checks: median coherence of the perturbation with torque and velocity in the band; the smaller.
    Unrelated signals show about 0.2
headline: Only {percent:.0f} % of the {signal}'s power follows the perturbation
measured: The coherence of perturbation and {signal} has a median of {value:.2f} in the band (at
    least {limit:g}); the rest is torque not from the robot (voluntary, friction), noise, or a joint
    that is not linear.
meaning: That may bias J, B and K.
remedy: Perturb more strongly, pool epochs, or repeat while only the robot moves the joint.
example: {"value": 0.31, "limit": 0.5}
<of_subject>

== residual_whiteness | note | 1 | min_residual_flatness
checks: spectral flatness of the residual in the band, 1 for white
headline: The residual is coloured (spectral flatness {value:.2f}; white = 1)
measured: The residual's spectral flatness in the band is {value:.2f} (at least {limit:g}; white =
    1): there is torque not from the robot, or the model lacks a term.
meaning: The intervals account for a residual of any colour.
remedy:
example: {"value": 0.42, "limit": 0.7}
<of_subject>

== residual_perturbation | caution | % | max_residual_perturbation_percent
checks: largest correlation of residual and perturbation up to 1 s either way, times the residual's
    SD, in % of the torque's SD
headline: {value:.2g} % of the torque follows the perturbation and is not explained
measured: The residual follows the perturbation by {value:.2g} % of the torque's SD (at most
    {limit:g} %), with a correlation of {correlation:.2f} at a lag of {lag_s:.2g} s (by chance up to
    {chance:.2f}).
meaning: The model lacks something that the perturbation causes; J, B and K may absorb it.
remedy: Look for a delay, a reflex or stiffness that changes with the angle; voluntary torque does
    this to least squares too.
example: {"value": 14.0, "limit": 10.0}
-- chance
meaning: The model lacks something, unless this is the one epoch in 20 that shows as much by chance;
    lack_of_fit tests all epochs together.
remedy:

== held_out_vaf | exclude | % | min_held_out_vaf_percent
checks: variance of the second half's torque explained by J, B and K of the first half
headline: The first half's J, B, K explain {value:.1f} % of the second
measured: J, B and K of the epoch's first half explain {value:.1f} % of the second half's torque (at
    least {limit:g} %).
meaning: The fit does not predict torque that it has not seen, so its numbers mean nothing.
remedy: Look for voluntary torque, and for a change during the epoch.
example: {"value": -40.2, "limit": 0.0}
<of_subject>

== r_squared | caution | 1 | min_r_squared
checks: R² of the fit
headline: J, B and K explain little of the torque: R² {value:.2g}
measured: R² is {value:.2g} (at least {limit:g}).
meaning: Most of the torque is not explained by J, B and K, and least squares attributes part of it
    to them.
remedy: Look for voluntary torque, or use --method iv with the recorded perturbation.
example: {"value": 0.21, "limit": 0.3}
<of_subject>

== gravity | note | N·m/rad | gravity_nm
checks: K without the slope m g l cos θ of the limb's weight, in N·m/rad, beside K itself; m g l is
    `gravity_nm`, and θ the angle from hanging straight down, `gravity_angle_deg` where the recorded
    angle is 0. Not looked at while `gravity_nm` is 0, as for a vertical `axis`
headline: K without the limb's weight is {value:.4g} N·m/rad
measured: K of {stiffness:.4g} N·m/rad includes {slope:.4g} of the limb's weight (m g l cos θ).
meaning: Without it K is {value:.4g} N·m/rad.
remedy: Report which of the two is given.
example: {"value": 1.404}

== negative_parameters | caution | 1 |
checks: number of J, B and K that are not positive
headline: {names}: not above zero
measured: {names}: not above zero.
meaning: No joint is like that: there may be voluntary torque, or the channels are delayed relative
    to each other.
remedy: Check the time stamps of torque and motion, and look for voluntary torque.
example: {"value": 1.0, "limit": 0.0}
-- noise
meaning: Not all of their intervals lie below zero, so the torque says little of a joint.
remedy: Check which column is the torque.
-- reaction
headline: J, B and K are below zero: the torque's sign is wrong
meaning: The torque has the sign of the joint's reaction.
remedy: Add --reaction.

== implausible_parameters | caution | 1 |
checks: largest factor by which J, B or K exceeds `min_inertia_kg_m2`, `max_inertia_kg_m2`,
    `max_damping_nm_s_rad` or `max_stiffness_nm_rad`
headline: {symbol} = {size:.3g} {size_unit} is too {side} for a joint
measured: {symbol} = {size:.3g} {size_unit} is {value:.3g} times beyond the end of its range.
meaning: No joint of a person or an animal is like that; a machine's axis may be.
remedy: Check the units of torque (N·m), angle (rad, not degrees) and time (s); for such an axis set
    the ranges in [diagnostics].
example: {"value": 57.0, "limit": 1.0, "size": 114000.0, "side": "large"}
""")
