"""Whose beat counts, and for how long a page that said so may be away."""

from types import SimpleNamespace

import pytest

from rigidimeter.rig.acquisition import State
from rigidimeter.rig.acquisition.processes import LoopStatus
from rigidimeter.rig.console.page import AWAY_S, SETTLES_S, SILENT_S, Place, Presence, ServerState

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


@pytest.mark.parametrize(
    ("state", "still", "may"),
    [
        (State.PAUSED, 1, True),
        (State.PAUSED, 0, False),  # on its way to rest, or pushed away
        (State.RUNNING, 0, False),
    ],
)
def test_a_page_may_be_away_from_a_session_that_shows_that_the_arm_is_still(
    tmp_path, state, still, may
):
    now_ns = BEGAN
    server = ServerState(Place(tmp_path, None, ""), now_ns=lambda: now_ns)
    loop = LoopStatus(tick=1, state=int(state), still=still)
    status = SimpleNamespace(loop=lambda: loop)
    look = server.console(None, tmp_path)
    look(SimpleNamespace(status=status, names=()))
    server.presence.arrive("page", "tab", BEGAN, session=False)
    now_ns = BEGAN + 2 * S
    assert server.operator_seen_ns() == BEGAN
    server.presence.leave("page", BEGAN + S)
    server.presence.gone("page")
    look(SimpleNamespace(status=status, names=()))
    assert server.operator_seen_ns() == (now_ns if may else BEGAN)


def test_a_page_that_left_before_the_first_tick_has_the_time_in_which_the_arm_settles(tmp_path):
    now_ns = BEGAN
    server = ServerState(Place(tmp_path, None, ""), now_ns=lambda: now_ns)
    shown = [LoopStatus()]
    memory = SimpleNamespace(status=SimpleNamespace(loop=lambda: shown[0]), names=())
    look = server.console(None, tmp_path)
    server.presence.arrive("page", "tab", BEGAN, session=False)
    server.presence.leave("page", BEGAN)
    now_ns = BEGAN + 3 * S
    look(memory)
    assert server.operator_seen_ns() == now_ns
    shown[0] = LoopStatus(tick=0)
    look(memory)
    now_ns += round(SETTLES_S * S) - 1
    assert server.operator_seen_ns() == now_ns
    now_ns += 1
    assert server.operator_seen_ns() == BEGAN
