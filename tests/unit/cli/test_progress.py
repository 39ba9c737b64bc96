"""The time left that is shown, by a clock that the test sets."""

import time
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

import rigidimeter as rm
from rigidimeter.analysis.reading import read
from rigidimeter.analysis.study import compare
from rigidimeter.cli.progress import LEAST_SHARE, Meter
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import design
from rigidimeter.virtual.batch import simulate_epochs


class Clock:
    """A clock that the test moves."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_the_time_left_is_that_of_an_even_speed() -> None:
    clock = Clock()
    meter = Meter("work", 50.0, clock)
    for done in range(1, 51):
        clock.now_s += 0.2
        meter.advance()
        if done < 5:
            assert meter.left_s is None
        else:
            assert meter.left_s == pytest.approx(0.2 * (50 - done))


def test_the_start_of_processes_is_no_work() -> None:
    clock = Clock()
    meter = Meter("work", 50.0, clock, from_first=True)
    clock.now_s += 30.0
    for _ in range(9):
        clock.now_s += 0.2
        meter.advance()
    assert meter.left_s == pytest.approx(0.2 * (50 - 9))


def test_lines_come_after_two_seconds_and_every_five(capsys: pytest.CaptureFixture[str]) -> None:
    clock = Clock()
    with Meter("work", 20.0, clock) as meter:
        for _ in range(20):
            clock.now_s += 1.0
            meter.advance()
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "work: 10 %, about 18 s left",
        "work: 35 %, about 13 s left",
        "work: 60 %, about 8 s left",
        "work: 85 %, about 3 s left",
    ]


def test_no_time_is_guessed_before_a_tenth_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    clock = Clock()
    meter = Meter("work", 100.0, clock)
    clock.now_s += 3.0
    meter.advance()
    assert capsys.readouterr().err == "work: 1 %\n"


def made(progress: Callable[[Callable[[float], None]], object]) -> list[float]:
    """Return the shares of the work that were reported."""
    shares: list[float] = []
    progress(shares.append)
    return shares


@pytest.mark.parametrize(("resamples", "parts"), [(0, 1), (100, 6)])
def test_a_comparison_reports_all_of_its_work(resamples: int, parts: int) -> None:
    """Of three columns, and of the three pairs of them."""
    rng = np.random.default_rng(1)
    table = pd.DataFrame({name: rng.standard_normal(9) for name in "abc"})
    table["condition"] = ["OFF"] * 5 + ["DBS"] * 4
    shares = made(
        lambda progress: compare(table, value=["a", "b", "c"], resamples=resamples,
                                 progress=progress)
    )  # fmt: skip
    assert sum(shares) == pytest.approx(1.0)
    assert len(shares) == parts


def test_a_search_for_a_perturbation_reports_each_sequence() -> None:
    small = {"bits_low": 6, "bits_high": 7, "clocks": 2}
    shares = made(lambda progress: design(search="minimax", progress=progress, optimise=small))
    assert shares == 4 * [0.25]


def simulated(delay_s: float) -> tuple[list[Epoch], Settings]:
    settings = parse_settings(
        {
            "subject": {"OFF": {"voluntary_sd_nm": 0.05}},
            "protocol": {"blocks": [{"epochs": 1}]},
            "rig": {"torque": {"latency_s": 0.001 + delay_s, "stamp_latency_s": 0.001}},
        }
    )
    batch = simulate_epochs(settings, 6, conditions="OFF", seed=3)
    epochs = [batch.epoch(i) for i in range(6)]
    half = [
        Epoch(f"day {i // 3}", e.label, e.channels, "OFF", "prbs") for i, e in enumerate(epochs)
    ]
    return half, settings


@pytest.mark.parametrize("delay_s", [0.0, 0.004], ids=["no delay", "a delay"])
def test_the_time_left_of_an_analysis_is_never_off_by_more_than_three(delay_s: float) -> None:
    """On the processor's clock, so that a busy machine changes nothing."""
    epochs, settings = simulated(delay_s)
    rm.estimate(epochs[:2], settings=settings)  # what is loaded once does not count
    clock, start_s = Clock(), time.process_time()
    clock.now_s = start_s
    meter = Meter("estimate", 1.0, clock)
    shown: list[tuple[float, float]] = []

    def progress(done: float) -> None:
        clock.now_s = time.process_time()
        meter.advance(done)
        if meter.left_s is not None:
            shown.append((clock.now_s, meter.left_s))

    rm.estimate(epochs, settings=settings, progress=progress)
    end_s = time.process_time()
    assert meter.share == pytest.approx(1.0)
    now_s, left_s = np.array(shown).T
    truly_s, least_s = end_s - now_s, LEAST_SHARE * (end_s - start_s)
    inside = truly_s > least_s  # towards the end a difference counts, not a factor
    assert inside.sum() > 3
    assert np.all(left_s[inside] < 3 * truly_s[inside])
    assert np.all(left_s[inside] > truly_s[inside] / 3)
    assert np.all(np.abs(left_s - truly_s)[~inside] < 2 * least_s)


def test_reading_advances_by_the_bytes_of_each_file(tmp_path) -> None:
    rng = np.random.default_rng(1)
    paths, sizes = [], []
    for number, seconds in enumerate((5, 20, 10)):
        time_s = np.arange(100 * seconds) / 100
        columns = {"time_s": time_s, "torque_nm": rng.normal(size=time_s.size)}
        columns["angle_rad"] = 0.1 * rng.normal(size=time_s.size)
        paths.append(tmp_path / f"{number}.csv")
        pd.DataFrame(columns).to_csv(paths[-1], index=False)
        sizes.append(paths[-1].stat().st_size)
    shares: list[float] = []
    read(paths, progress=shares.append)
    assert np.cumsum(shares) == pytest.approx(np.cumsum([0, *sizes]) / sum(sizes))
