"""How far a session has come, told by its events."""

from rigidimeter.core.session import PlannedEpoch
from rigidimeter.rig.console import progress_after, progress_at_start

EPOCHS = (
    PlannedEpoch(1, "1", "prbs", "OFF", 20.0, 10.0),
    PlannedEpoch(2, "2", "sinusoid", "OFF", 20.0, 20.0),
    PlannedEpoch(3, "3", "prbs", "DBS", 20.0, 10.0),
)


def started(number, label, time_s=0.0):
    return {
        "event": "epoch_started",
        "epoch": number,
        "label": label,
        "task": "prbs",
        "condition": "OFF",
        "time_s": time_s,
        "planned_s": 20.0,
    }


def ended(number, outcome="success", time_s=20.0, **more):
    return {
        "event": "epoch_ended",
        "epoch": number,
        "time_s": time_s,
        "outcome": outcome,
        "reason": "" if outcome == "success" else "why",
        **more,
    }


def told(*events):
    progress = progress_at_start(EPOCHS)
    for event in events:
        progress = progress_after(progress, event)
    return progress


def test_an_epoch_runs_ends_and_leaves_the_others():
    progress = told(started(1, "1", 5.0))
    assert (progress.current, progress.running) == (EPOCHS[0], True)
    assert progress.to_run == EPOCHS[1:]
    progress = progress_after(progress, ended(1, time_s=25.0))
    assert not progress.running
    assert progress.current == EPOCHS[0]  # whose rest runs
    assert [(e.place, e.outcome, e.started_s, e.ended_s) for e in progress.ended] == [
        (1, "success", 5.0, 25.0)
    ]


def test_one_that_the_operator_ended_comes_next_and_keeps_its_place():
    progress = told(started(1, "1"), ended(1, "abort", again_as=4))
    assert [epoch.label for epoch in progress.to_run] == ["1r", "2", "3"]
    assert progress.to_run[0].number == 4
    progress = progress_after(progress_after(progress, started(4, "1r")), ended(4))
    assert [(e.number, e.place, e.repeated) for e in progress.ended] == [
        (1, 1, True),
        (4, 1, False),
    ]
    assert progress.to_run == EPOCHS[1:]


def test_one_that_failed_comes_last():
    progress = told(started(1, "1"), ended(1, "fail", again_as=4))
    assert [epoch.label for epoch in progress.to_run] == ["2", "3", "1r"]


def test_one_that_is_not_repeated_is_left():
    progress = told(started(1, "1"), ended(1, "fail"))
    assert progress.to_run == EPOCHS[1:]
    assert progress.ended[0].reason == "why"


def test_an_epoch_that_nobody_planned_is_known_from_its_event():
    progress = told(started(9, "extra"))
    assert progress.current == PlannedEpoch(9, "extra", "prbs", "OFF", 20.0, 0.0)
    assert progress.to_run == EPOCHS


def test_the_sensor_is_zeroed_unless_that_was_refused_and_the_session_ends():
    assert told({"event": "sensor_zeroed", "refused": ""}).zeroed
    assert not told({"event": "sensor_zeroed", "refused": "it moved"}).zeroed
    over = told(started(1, "1"), {"event": "session_ended", "outcome": "fail", "reason": "why"})
    assert (over.running, over.outcome, over.reason) == (False, "fail", "why")


def test_why_the_guard_latched_is_kept():
    assert told({"event": "guard_latched", "sentence": "too fast"}).stop == "too fast"


def test_other_events_change_nothing():
    progress = told(started(1, "1"))
    assert progress_after(progress, {"event": "order", "command": "pause"}) is progress
    assert progress_after(progress, ended(2)) is progress


def test_single_wild_samples_are_counted_up_to_the_last_epoch_that_ended():
    assert told(started(1, "1"), ended(1)).wild_samples == 0  # an older record
    counts = {"torque_lost": 3, "torque_wild": 2}
    assert told(started(1, "1"), ended(1, counts=counts)).wild_samples == 2
