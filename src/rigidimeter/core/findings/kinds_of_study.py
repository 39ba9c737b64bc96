"""Findings of recordings beside each other: what else than the condition may make a difference.

Their levels cannot be set, for a verdict follows from them.
"""

from __future__ import annotations

from rigidimeter.core.findings.kind import kinds_of

STUDY_KINDS = kinds_of("""
== inertia_of_recordings | caution | % |
checks: by how much the largest median J of a recording exceeds the smallest
headline: J of {high} is {value:.0f} % above that of {low}
measured: The median J of {high} is {high_j:.4g} kg·m², that of {low} {low_j:.4g}, {value:.0f} %
    less (at most {limit:g} %).
meaning: B and K with J held at one median are wrong for both.
remedy: Analyse different joints separately.
example: {"value": 31.0, "limit": 15.0, "high": "b.csv", "low": "a.csv"}

== inertia_of_conditions | caution | % |
checks: difference of the mean J of two conditions, in % of the reference, where the test finds it
headline: Inertia differs by {value:.2g} %, and no treatment changes it
measured: The mean J is {first:.4g} kg·m² in {reference} and {second:.4g} in {other}.
meaning: The posture, the contact with the robot, a unit, or voluntary torque was different, which
    changes B and K as well.
remedy: Compare how the arm was fixed, the units, and the voluntary torque.
example: {"value": 17.0, "first": 0.0045, "second": 0.0054, "others": " (or 1 other finding)"}
-- flagged
headline: Inertia differs by {value:.2g} %, and no treatment changes it: {cause} may
meaning: There is {cause}{others} in {counts}, which changes J, B and K.
-- degrees
headline: Inertia differs by a factor of about 57, as where degrees are read as radians
meaning: B and K differ by the same factor.
remedy: Check the unit of the angle in both.

== flagged_epochs | caution | % |
checks: largest share of a condition's epochs that carry a caution, where the difference is not
    found without them; where none is found, from 10 % on
headline: {cause} in {counts}
measured: There is {cause}{others} in {counts}; without these epochs {without}.
meaning: What is in the epochs of one condition alone can make a difference.
remedy: Repeat these epochs, or use a method that the finding does not bias.
example: {"value": 83.0, "limit": 10.0, "others": " (or 1 other finding)"}
-- hides
headline: {cause} can hide differences: {counts}
measured: There is {cause}{others} in {counts}.
meaning: What it does to J, B and K can hide a difference.
-- together
headline: {cause} in all epochs of a condition together
measured: The fit to all epochs of {where} has the finding {cause}{counts}.
meaning: Its bias can be as large as the difference.

== groups_differ | caution | 1 |
checks: number of groups of subjects, where not each of them shows the difference by itself
headline: each group alone: {groups}
measured: Within each group by itself: {groups}.
meaning: A mean over groups that respond differently speaks of none of them. Whether the groups
    differ from each other is not tested.
remedy: Compare each group by itself: --group NAME, or group= in Python.
example: {"value": 2.0, "groups": "patients −18 % (p = 0.001), controls 0 % (p = 0.9)"}

== examiners_of_one_condition | caution | 1 |
checks: number of examiners who rated one of the conditions alone, where the difference is not found
    without them
headline: {who} rated one of the conditions alone
measured: {who} rated one of the conditions alone; without these ratings {without}.
meaning: The effects of examiner and condition cannot be separated.
remedy: Have every examiner rate both conditions.
example: {"value": 2.0, "without": "p = 0.4"}
-- hides
headline: {who} rated one of the conditions alone, which can hide a difference
measured: {who} rated one of the conditions alone.
meaning: The offsets of these examiners can hide a difference.

== unknown_days | caution | 1 |
checks: number of recordings that stand for days, since none is stated
headline: Which recordings are of one day is not known
measured: {value:g} recordings were compared as if each were of a day of its own.
meaning: A day may move all of its recordings alike, by its cuff, posture and arm.
remedy: State their days in a study folder.
example: {"value": 8.0}

== order_of_conditions | caution | 1 |
checks: number of days of a condition that all come after those of the other
headline: All days in {later} came after all days in {earlier}
measured: All {value:g} days in {later} came after all days in {earlier}.
meaning: A change with time would have the same effect as the condition.
remedy: Alternate the days, or record days with both conditions.
example: {"value": 4.0}

== within_accuracy | note | % | max_between_samples_percent
checks: difference of J, B or K, in % of the larger
headline: {value:.2g} % is within the {limit:g} % that motion between samples may cause
measured: They differ by {value:.2g} % (at most {limit:g} %).
meaning: How the joint moves between the samples is known no better, whatever p.
remedy: Use a drive and a rate that show the motion between the samples.
example: {"value": 0.5, "limit": 1.0}

== wide_interval | note | % |
checks: half the interval of a difference that was not found, at the level of the first test of its
    family, in % of the reference: a difference of this size is found in one study of two
headline: The chance to show a difference of {limit:g} % was below one half
measured: Half the interval, at 0.05 over {tests}, is {value:.3g} % of the reference (at most
    {limit:g} %).
meaning: A difference as large may be there.
remedy: Record more days, subjects or values, or declare fewer primary measures.
example: {"value": 64.0, "limit": 20.0, "first": 3, "second": 3, "exact": 0.1, "alpha": 0.05,
    "tests": "2 tests"}
-- held
headline: The 95 % interval holds a difference of {limit:g} %
measured: Half the interval, at 0.05 over {tests}, is {value:.3g} % of the reference, but the
    estimate is too far from zero to exclude {limit:g} %.
-- negative
headline: {limit:g} % of values of which some are negative has no meaning
measured: Some values are negative, so no size in % says what is worth finding.
-- zero
headline: {limit:g} % of a reference of 0 is 0
measured: The reference is 0, so no size in % says what is worth finding.
-- values
headline: {first} values against {second} cannot reach p < {alpha:g}{of}
measured: Even where no value of one group is within the other, p is above that ({exact:.2g} by the
    exact test of one measure).

== earlier_in_sequence | note | 1 |
checks: p of a measure after one that is not shown, in the declared sequence
headline: In the declared sequence it comes after {before}, which is not shown
measured: By itself p is {value:.2g}, but in the declared sequence it comes after {before}, which is
    not shown.
meaning: It is not tested then, as was declared.
remedy: Declare another sequence for the next study.
example: {"value": 0.01, "before": "K"}

== unused_recordings | caution | 1 |
checks: number of recordings of a condition that were left out, where none is left
headline: {which} in {lost} could not be used: {reason}
measured: {which} in {lost} could not be used: {reason}.
meaning: So there is nothing to compare.
remedy: See why each recording was left out.
example: {"value": 1.0}

== no_test | caution |  |
checks: whether there are values, days or recordings enough in both conditions
headline: {remark}
measured: There is no test: {remark}.
meaning: So p and the interval of the difference are unknown.
remedy: Record more of what is lacking.
example: {"value": NaN}
""")
