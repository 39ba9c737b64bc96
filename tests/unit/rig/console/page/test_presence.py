"""Whose beat counts, and for how long a page that said so may be away."""

from types import SimpleNamespace

import pytest

from rigidimeter.rig.acquisition import State
from rigidimeter.rig.acquisition.processes import LoopStatus
from rigidimeter.rig.console.page import AWAY_S, SILENT_S, Place, Presence, ServerState

S = 1_000_000_000
BEGAN = 1000 * S


@pytest.fixture
def presence():
    presence = Presence()
    assert presence.arrive("page", "tab", BEGAN, session=False)
    return presence


def test_a_silent_page_does_not_count_as_there(presence):
    presence.beat("page", BEGAN + S)
    later = BEGAN + 3 * S
    assert presence.seen_ns(later, still=False) == BEGAN + S
    assert presence.seen_ns(later, still=True) == BEGAN + S  # it never said that it goes


def test_only_the_page_in_control_beats(presence):
    assert not presence.arrive("other", "other tab", BEGAN, session=True)
    presence.beat("other", BEGAN + S)
    assert presence.seen_ns(BEGAN + S, still=False) == BEGAN
    assert not presence.leave("other", BEGAN + S)
    assert not presence.has_control("other")
    assert not presence.has_control("")


def test_a_page_that_leaves_counts_while_the_arm_is_held_and_not_longer(presence):
    assert presence.leave("page", BEGAN)
    presence.gone("page")
    for after_s, still, there in (
        (0.2, False, True),  # the loop has not shown yet that it is paused
        (0.5, False, False),  # it should have
        (0.5, True, True),
        (AWAY_S - 0.1, True, True),
        (AWAY_S + 0.1, True, False),
    ):
        now = BEGAN + round(after_s * S)
        assert (presence.seen_ns(now, still=still) == now) == there, after_s


@pytest.mark.parametrize("closed_first", [True, False])
def test_a_reloaded_page_takes_control_again(presence, closed_first):
    presence.leave("page", BEGAN)
    if closed_first:
        presence.gone("page")
    assert presence.arrive("new page", "tab", BEGAN + S, session=True)
    presence.gone("page")
    assert presence.has_control("new page")
    assert presence.seen_ns(BEGAN + 2 * S, still=True) == BEGAN + S


def test_a_copy_of_the_tab_only_looks(presence):
    """A duplicated tab has the secret of the first, which is still there."""
    assert not presence.arrive("copy", "tab", BEGAN + S // 10, session=True)


def test_during_a_session_another_tab_has_to_wait(presence):
    presence.leave("page", BEGAN)
    presence.gone("page")
    assert not presence.arrive("other", "other tab", BEGAN + S, session=True)
    assert presence.arrive("other", "other tab", BEGAN + round(AWAY_S * S) + 1, session=True)


def test_a_page_that_is_lost_without_a_word_gives_control_to_the_next(presence):
    presence.gone("page")
    assert not presence.arrive("other", "other tab", BEGAN + S // 10, session=True)
    assert presence.arrive("other", "other tab", BEGAN + round(SILENT_S * S) + 1, session=True)


@pytest.mark.parametrize(("run", "may"), [(State.PAUSED, True), (State.RUNNING, False)])
def test_a_page_may_be_away_from_a_session_that_shows_that_it_is_paused(tmp_path, run, may):
    now_ns = BEGAN + 2 * S
    state = ServerState(Place(tmp_path, None, ""), now_ns=lambda: now_ns)
    state.presence.arrive("page", "tab", BEGAN, session=False)
    assert state.operator_seen_ns() == BEGAN
    state.presence.leave("page", BEGAN + S)
    state.presence.gone("page")
    loop = LoopStatus(tick=1, state=int(run))
    status = SimpleNamespace(loop=lambda: loop)
    state.console(None, tmp_path)(SimpleNamespace(status=status, names=()))
    assert state.operator_seen_ns() == (now_ns if may else BEGAN)
