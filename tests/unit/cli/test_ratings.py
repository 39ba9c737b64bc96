"""`rigidimeter ratings`: numbers, sentences, and files as spreadsheets write them."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.special import stdtrit

from rigidimeter.analysis.statistics import difference, fit_mixed

SCORES = [2.0, 1.5, 2.5, 2.0, 2.5, 3.0, 1.5, 2.0, 2.0, 1.0, 1.5, 2.0, 1.0, 2.0, 1.5]
CONDITIONS = ["OFF"] * 9 + ["DBS"] * 6
EXAMINERS = ["A", "B", "C"] * 5
DAYS = [str(k // 3 + 1) for k in range(15)]
ROWS = list(zip(CONDITIONS, DAYS, EXAMINERS, map(str, SCORES), strict=True))
HEADER = ("condition", "day", "examiner", "score")


def write(path: Path, rows=ROWS, header=HEADER, separator: str = ",") -> Path:
    path.write_text("".join(separator.join(row) + "\n" for row in [header, *rows]), "utf-8")
    return path


def changed(row: int, column: str, value: str) -> list[tuple[str, ...]]:
    """Return the rows with one cell of the file's line `row` changed."""
    rows = [list(cells) for cells in ROWS]
    rows[row - 2][HEADER.index(column)] = value
    return [tuple(cells) for cells in rows]


@pytest.fixture
def model(rigidimeter, tmp_path):
    def run(rows=ROWS, *options: str, header=HEADER):
        out = tmp_path / "out.json"
        ran = rigidimeter(
            "ratings", write(tmp_path / "r.csv", rows, header), "--json", out, *options
        )
        return ran, json.loads(out.read_text("utf-8")) if out.exists() else None

    return run


def test_the_document_holds_the_model_unrounded(model) -> None:
    ran, found = model()
    assert ran.status == 0, ran.err
    fit = fit_mixed(SCORES, CONDITIONS, {"examiner": EXAMINERS, "day": DAYS})
    test = difference(fit, "DBS", "OFF")
    assert found["schema"] == "rigidimeter.ratings/1"
    assert found["means"] == {"OFF": fit.means[0], "DBS": fit.means[1]}
    for key in ("estimate", "se", "f", "df_residual", "p_residual", "df_satterthwaite",
                "p_satterthwaite", "df_kenward_roger", "p_kenward_roger"):  # fmt: skip
        assert found["contrast"][key] == getattr(test, key)
    assert found["contrast"]["convention"] == "DBS minus OFF"
    assert found["offsets"] == dict(fit.offsets["examiner"])
    assert found["variance_examiner"] == fit.variances["examiner"]
    assert found["variance_residual"] == fit.variance_residual
    assert found["corrected"] == fit.corrected.tolist()
    assert [row["line"] for row in found["rows"]] == list(range(2, 17))
    assert found["notices"] == []
    assert "DBS minus OFF" in ran.out
    assert "Satterthwaite" in ran.out
    assert "DBS was rated lower than OFF" in ran.out


def test_days_of_one_subject_are_random(model) -> None:
    ran, found = model()
    assert list(found["variances"]) == ["examiner", "day"]
    low, high = found["contrast"]["estimate"] + (
        stdtrit(found["contrast"]["df_kenward_roger"], [0.025, 0.975])
        * found["contrast"]["se_kenward_roger"]
    )
    assert f"[{low:.4g} to {high:.4g}, 95 %]" in ran.out
    assert ran.out.index("Kenward and Roger") < ran.out.index("n − p")


def test_a_day_with_both_conditions_has_an_offset_for_each_too(model) -> None:
    """The same test as that of a study (`contrast_days`)."""
    days = [str(k % 9 // 3 + 1) for k in range(15)]
    _, found = model(list(zip(CONDITIONS, days, EXAMINERS, map(str, SCORES), strict=True)))
    visits = [f"{day}/{c}" for day, c in zip(days, CONDITIONS, strict=True)]
    groups = {"examiner": EXAMINERS, "day": days, "day/condition": visits}
    test = difference(fit_mixed(SCORES, CONDITIONS, groups), "DBS", "OFF")
    assert list(found["variances"]) == list(groups)
    assert found["contrast"]["p_kenward_roger"] == test.p_kenward_roger


def test_the_papers_model_without_days_is_an_option(model) -> None:
    _, found = model(ROWS, "--random", "examiner")
    test = difference(fit_mixed(SCORES, CONDITIONS, {"examiner": EXAMINERS}), "DBS", "OFF")
    assert found["contrast"]["p_residual"] == test.p_residual
    assert [n for n in found["notices"] if "there are 5 days" in n and "--random day" in n]


WITHOUT_DAYS = {
    "one day in each condition": (
        [(c, c, f"{e}{k}", s) for k, (c, _, e, s) in enumerate(ROWS)],
        "each condition was rated on one day, so how much days differ is unknown",
    ),
    "no residual beside days": (
        [(c, d, e, str(1 + int(d) % 3 / 2)) for c, d, e, _ in ROWS],
        "the model has no offset for days, so ratings of one day count as independent, for the "
        "scores do not vary beyond the means and offsets",
    ),
    "no days": (
        [(c, "", e, s) for c, _, e, s in ROWS],
        "no days are given, so ratings of one day count as independent",
    ),
}


@pytest.mark.parametrize("case", WITHOUT_DAYS)
def test_where_days_cannot_be_modelled_a_sentence_says_so(model, case: str) -> None:
    rows, sentence = WITHOUT_DAYS[case]
    ran, found = model(rows)
    assert ran.status == 0, ran.err
    assert list(found["variances"]) == ["examiner"]
    assert sentence in ran.err.replace("\n", " ")
    assert sum(sentence in notice for notice in found["notices"]) == 1


def test_one_rating_a_day_needs_no_offset_for_it(model) -> None:
    """What differs between days is in the residual."""
    rows = [(c, str(k), e, s) for k, (c, _, e, s) in enumerate(ROWS)]
    ran, found = model(rows)
    assert list(found["variances"]) == ["examiner"]
    assert (ran.status, ran.err, found["notices"]) == (0, "", [])


def test_days_that_differ_give_no_difference_of_conditions(model) -> None:
    """Nine days and four, three examiners: the paper's, of 60 tables without a difference."""
    rng = np.random.default_rng(11)
    below = np.zeros(2)
    for _ in range(60):
        rows = [
            (c, f"{c}{day}", e, f"{score:.6f}")
            for c, days in (("OFF", 9), ("DBS", 4))
            for day, of_day in enumerate(rng.normal(5, 0.6, days))
            for e, score in zip("ABC", of_day + rng.normal(0, 0.45, 3), strict=True)
        ]
        for k, random in enumerate((("--random", "examiner"), ())):
            _, found = model(rows, "--scale", "0", "10", "--step", "0", *random)
            key = "p_residual" if random else "p_kenward_roger"
            below[k] += found["contrast"][key] < 0.05
    assert below[0] >= 12  # 20 % and more
    assert below[1] <= 6


def test_off_comes_first_whatever_the_file_s_order(model) -> None:
    _, plain = model()
    _, found = model(ROWS[::-1])
    assert found["contrast"]["convention"] == "DBS minus OFF"
    assert found["contrast"]["estimate"] == pytest.approx(plain["contrast"]["estimate"])
    _, turned = model(ROWS, "--contrast", "OFF", "DBS")
    assert turned["contrast"]["estimate"] == pytest.approx(-plain["contrast"]["estimate"])
    assert turned["contrast"]["convention"] == "OFF minus DBS"


@pytest.mark.parametrize("kind", ["bom", "semicolon", "utf16", "tab", "comments", "quoted", "crlf"])
def test_files_as_spreadsheets_write_them(rigidimeter, tmp_path, kind: str) -> None:
    path = write(tmp_path / "r.csv")
    text = path.read_text("utf-8")
    data = {
        "bom": b"\xef\xbb\xbf" + text.encode(),
        "semicolon": text.replace(",", ";").replace(".", ",").encode(),
        "utf16": text.encode("utf-16"),
        "tab": text.replace(",", "\t").replace(".", ",").encode(),
        "comments": b"# ratings of spring\n\n" + text.replace("OFF,2", "#\n OFF ,2").encode(),
        "quoted": "\n".join(
            ",".join(f'"{cell.replace(".", ",")}"' for cell in line.split(","))
            for line in text.splitlines()
        ).encode(),
        "crlf": text.replace("\n", "\r\n").encode(),
    }[kind]
    path.write_bytes(data)
    ran = rigidimeter("ratings", path, "--json", tmp_path / "o.json")
    assert ran.status == 0, ran.err
    found = json.loads((tmp_path / "o.json").read_text("utf-8"))
    assert [row["score"] for row in found["rows"]] == SCORES


REFUSED = [
    (changed(5, "score", "3.5"), (), "line 5: score is 3.5, outside the scale of 0 to 3"),
    (changed(5, "score", "-0.5"), (), "line 5: score is -0.5, outside the scale"),
    (changed(6, "score", "two"), (), "line 6: score is 'two', which is not a number"),
    (changed(6, "score", "inf"), (), "line 6: score is 'inf', which is not a number"),
    (changed(6, "score", "1e999"), (), "line 6: score is 1e999, which is too large"),
    (ROWS[:9], (), "ratings of one condition only (OFF)"),
    (ROWS[:2], (), "holds 2 ratings; at least 3"),
    (changed(2, "score", "")[:3], (), "holds 2 ratings (1 more lack a score or a label)"),
    ([], (), "names its columns in line 1 but has no rows"),
    ([ROWS[0][:3]], (), "line 2 has 3 values, but the first line names 4 columns"),
    ([("OFF", "1", "A", "2,0")] * 2, (), "line 2 has 5 values"),
    (
        ROWS,
        ("--score", "updrs"),
        "no column updrs; its columns are condition, day, examiner, score",
    ),
    (ROWS, ("--random", "subject"), "there is no column subject"),
    (
        ROWS,
        ("--random", "days"),
        "--random days: must be one of examiner, subject, subject/day, day",
    ),
    (
        ROWS,
        ("--contrast", "OFF", "ON"),
        "--contrast ON: there is no such condition; rated are: OFF",
    ),
    (ROWS, ("--contrast", "OFF", "OFF"), "name two different conditions"),
    (ROWS, ("--scale", "3", "0"), "write the lowest and then the highest"),
    ([(c, d, e, "1") for c, d, e, _ in ROWS], (), "do not vary beyond the means"),
]


@pytest.mark.parametrize(("rows", "options", "sentence"), REFUSED)
def test_what_is_wrong_is_one_sentence(model, rows, options, sentence: str) -> None:
    ran, found = model(rows, *options)
    assert ran.status == 1
    assert sentence in ran.err
    assert ran.err.startswith("rigidimeter: ")
    assert ran.err.count("\n") == 1
    assert found is None


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is empty; its first line must name the columns"),
        (b"# only a remark\n", "is empty"),
        (b"OFF,1,A,2\n1,2,3,4\n", "there is no column condition"),
        (b"1,2,3\n", "its first line holds numbers (1, 2, 3)"),
        (b"score,score\n1,2\n", "two columns are named score"),
        (b"\x89PNG\r\n\x1a\n", "not a text file"),
        (b"a,b\x00\n", "not a text file"),
        (None, "cannot be read"),
    ],
)
def test_what_is_no_table_is_one_sentence(rigidimeter, tmp_path, content, sentence: str) -> None:
    path = tmp_path / "r.csv"
    if content is not None:
        path.write_bytes(content)
    ran = rigidimeter("ratings", path)
    assert ran.status == 1
    assert sentence in ran.err
    assert ran.err.count("\n") == 1


SAID = [
    (changed(5, "score", "2.2"), "not in steps of 0.5: 2.2 in line 5; used as they are", 15),
    (changed(5, "score", "NA"), "line 5: no score is given; the row was left out", 14),
    (changed(5, "examiner", ""), "line 5: no examiner is given; the row was left out", 14),
    (
        [*ROWS, *[("OFF", "1", "A", "")] * 7],
        "lines 17, 18, 19, 20, 21 and 2 more: no score is given; the rows were left out",
        15,
    ),
    ([*ROWS, ROWS[-1]], "lines 16 and 17: rated more than once by examiner C in DBS on day 5", 16),
    ([*ROWS, ("OFF", "9", "D", "2.0")], "examiner D gave one rating", 16),
    (
        [(c, d, "A", s) for c, d, _, s in ROWS],
        "examiner was left out of the model: there is only",
        15,
    ),
]


@pytest.mark.parametrize(("rows", "sentence", "n"), SAID)
def test_what_is_odd_is_said_and_nothing_is_lost(model, rows, sentence: str, n: int) -> None:
    ran, found = model(rows)
    assert ran.status == 0, ran.err
    assert any(sentence in notice for notice in found["notices"])
    assert sentence in ran.out + ran.err
    assert found["n"] == n == len(found["corrected"])
    assert len(found["left_out_lines"]) == len(rows) - n


def test_a_variance_of_zero_is_said_in_words(model) -> None:
    rows = [(c, d, e, "1.5" if k % 2 else "2.5") for k, (c, d, e, _) in enumerate(ROWS)]
    ran, found = model(rows)
    assert found["variance_examiner"] == 0
    assert "the variance of examiner is estimated as zero, its boundary" in ran.out
    assert found["corrected"] == [row["score"] for row in found["rows"]]


def test_another_scale_is_an_option(model) -> None:
    rows = [(c, d, e, f"{4 * float(s) / 3:.3f}") for c, d, e, s in ROWS]
    ran, found = model(rows, "--scale", "0", "4", "--step", "0")
    assert ran.status == 0
    assert found["notices"] == []


def test_subjects_and_their_days(model) -> None:
    rows = [(c, d, e, f"{min(float(s) + (p == 'q'), 3.0)}", p) for p in "pq" for c, d, e, s in ROWS]
    header = (*HEADER, "subject")
    ran, found = model(rows, "--random", "subject/day", header=header)
    assert ran.status == 0, ran.err
    assert list(found["variances"]) == ["subject", "subject/day"]
    assert len(found["offsets_by"]["subject/day"]) == 10
    assert found["variance_examiner"] is None
    assert any("3 examiners, but the model has no offset for them" in n for n in found["notices"])
    ran, found = model(rows, "--random", "examiner", "--random", "subject", header=header)
    assert list(found["variances"]) == ["examiner", "subject"]
    assert [n for n in found["notices"] if "add --random day" in n] == found["notices"]
    three = ("--random", "examiner", "--random", "subject", "--random", "day")
    _, found = model(rows, *three, header=header)
    assert len(found["offsets_by"]["day"]) == 10  # a day belongs to its subject
    assert found["notices"] == []


def test_three_conditions_give_all_pairs_and_a_joint_test(model) -> None:
    rows = [*ROWS, *(("LOW", d, e, s) for _, d, e, s in ROWS[:6])]
    ran, found = model(rows)
    assert [c["convention"] for c in found["contrasts"]] == [
        "DBS minus OFF", "LOW minus OFF", "LOW minus DBS",
    ]  # fmt: skip
    assert all(c["p_residual_holm"] >= c["p_residual"] for c in found["contrasts"])
    assert found["joint"]["df_numerator"] == 2
    assert "All means equal: F(2, 18)" in ran.out


def test_the_table_is_never_written_over(rigidimeter, tmp_path) -> None:
    path = write(tmp_path / "r.csv")
    before = path.read_bytes()
    assert rigidimeter("ratings", path, "--json", path).status == 1
    assert path.read_bytes() == before
