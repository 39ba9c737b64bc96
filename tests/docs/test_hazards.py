"""The short table of faults, for users, has the times of the measured one."""

from __future__ import annotations

from tests.faults.measure import BEGIN, END, FAULTS, FAULTS_PAGE, HAZARDS, IN_SHORT, in_short


def test_the_short_table_is_that_of_the_measured_one() -> None:
    long, short = (
        page.read_text("utf-8").partition(BEGIN)[2].partition(END)[0]
        for page in (FAULTS_PAGE, HAZARDS)
    )
    assert short.strip() == in_short(long)


def test_of_several_faults_the_slowest_is_shown() -> None:
    rows = {number: "at rest 3 ms" for number in FAULTS}
    rows |= {1: "named 9 ms<br>at rest 12–35 ms", 13: "reached 20 of 20 deg", 19: "at rest 7–90 ms"}
    table = "\n".join(f"| {n} | a | b | S1 | at rest 999 ms | {rows[n]} | c |" for n in rows)
    shown = [line.split(" | ")[-1].strip("| ") for line in in_short(table).splitlines()[2:]]
    expected = {(1, 4, 7): "35 ms", (13,): "reached 20 of 20 deg", (19,): "90 ms"}
    assert shown == [expected.get(faults, "3 ms") for _, _, faults in IN_SHORT]
