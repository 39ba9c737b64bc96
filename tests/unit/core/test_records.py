from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.reading import write_estimates_csv
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import (
    PARAMETER_VECTORS,
    PARAMETERS,
    Analysis,
    Channel,
    Fit,
    Outcome,
    Score,
    grouped,
)

FIT = Fit(
    "a.csv", "1", "OFF", "iv", Outcome(),
    value=np.array([1.0, 2.0, 3.0]), se=np.array([0.1, 0.2, 0.3]), low=np.array([0.8, 1.6, 2.4]),
    high=np.array([1.2, 2.4, 3.6]), bound=np.array([0.05, 0.15, 0.25]),
)  # fmt: skip


def test_every_entry_of_a_vector_has_its_name():
    for index, parameter in enumerate(PARAMETERS):
        for vector, ending in PARAMETER_VECTORS.items():
            assert getattr(FIT, parameter.name + ending) == getattr(FIT, vector)[index]
    assert FIT.names == ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


def test_a_fit_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        FIT.value[0] = 7.0
    with pytest.raises(AttributeError):
        FIT.inertia_kg_m2 = 7.0


def test_a_vector_of_another_length_is_refused():
    with pytest.raises(ValueError, match=r"se of a fit must have shape \(3,\), not \(2,\)"):
        replace(FIT, se=np.zeros(2))


def test_fits_are_equal_when_every_number_is():
    assert replace(FIT) == FIT  # the covariance is NaN in both
    assert hash(replace(FIT)) == hash(FIT)
    assert replace(FIT, high=np.array([1.2, 2.4, 3.7])) != FIT
    assert replace(FIT, epoch="2") != FIT


def analysis(**changes):
    left_out = replace(FIT, epoch="2", outcome=Outcome("excluded", "R² < 0 & worse"))
    found = Finding(
        "frozen", "exclude", 2.0, 1.0, facts={"channel": "angle <hung>", "start_s": 3.0}
    )
    fits = (replace(FIT, findings=(found,)), replace(left_out, findings=(found,)))
    return Analysis(
        **{
            "method": "iv",
            "fits": fits,
            "fixed_inertia": fits,
            "inertia_kg_m2": 1.0,
            "scores": (Score("a.csv", "3", "OFF", Outcome(), 0.4, 0.2, 8, 1.0),),
            "pooled": (replace(FIT, epoch="pooled"),),
            **changes,
        }
    )


def test_the_table_has_the_columns_of_the_csv(tmp_path):
    write_estimates_csv(tmp_path / "e.csv", analysis())
    table = analysis().table(full=True)
    assert list(table.columns) == (tmp_path / "e.csv").read_text().splitlines()[0].split(",")
    assert table["stiffness_nm_rad"].tolist() == [3.0, 3.0]
    assert table["outcome"].tolist() == ["included", "excluded"]
    only_scores = analysis(fits=(), fixed_inertia=(), pooled=())
    assert only_scores.table()["work_j"].tolist() == [0.2]


def test_the_table_that_people_read_has_thirteen_columns():
    table = analysis().table()
    assert list(table.columns) == [
        "source", "epoch", "condition", "inertia_kg_m2", "inertia_kg_m2_se", "damping_nm_s_rad",
        "damping_nm_s_rad_se", "stiffness_nm_rad", "stiffness_nm_rad_se", "angle_rms_rad",
        "vaf_percent", "outcome", "findings",
    ]  # fmt: skip
    assert table["findings"].tolist() == ["frozen", "frozen"]
    assert table.equals(analysis().table(full=True)[table.columns[:-1]].assign(findings="frozen"))


def test_a_fit_and_an_analysis_are_printed_as_one_line():
    value, se = np.array([4.59e-3, 0.159, 1.7]), np.array([1.1e-5, 0.0012, 0.013])
    fit = replace(FIT, band_hz=(0.1, 30.0), vaf_percent=99.61, value=value, se=se)
    assert repr(fit) == (
        "J (4.590 ± 0.011)·10⁻³ kg·m², B 0.1590 ± 0.0012 N·m·s/rad, K 1.700 ± 0.013 N·m/rad; "
        "iv, 0.1–30 Hz, VAF 99.6 %; epoch 1 OFF"
    )
    failed = Fit("a.csv", "2\n3", "OFF", "iv", Outcome("failed", "too short"))
    assert repr(failed) == "iv; epoch 2 3 OFF; failed: too short"
    assert repr(analysis()) == (
        "2 epochs by iv, 1 included; 1 sinusoid scored; OFF J 1.00 ± 0.10 kg·m², "
        "B 2.00 ± 0.20 N·m·s/rad, K 3.00 ± 0.30 N·m/rad; findings: frozen"
    )
    assert (
        "<td>1.670\xa0to\xa01.730</td>"
        in replace(fit, low=np.array([0, 0, 1.67]), high=np.array([1, 1, 1.73]))._repr_html_()
    )


def test_which_stiffness_it_is_and_at_what_motion_is_said_in_few_words():
    assert analysis(fits=(), fixed_inertia=(), pooled=()).stiffness_words == ""
    weight = "includes the slope of the limb's weight"
    assert analysis(axis="horizontal").stiffness_words == f"{weight} (not corrected)"
    assert analysis(axis="vertical").stiffness_words == ""
    failed = replace(FIT, value=np.full(3, np.nan))
    none = analysis(fits=(failed,), fixed_inertia=(failed,), pooled=())
    assert none.stiffness_words == ""
    assert " K ." not in none._repr_html_()
    rad = np.pi / 180
    swung = replace(FIT, angle_rms_rad=2 * rad, angle_range_rad=9 * rad)
    pooled = (
        replace(swung, epoch="pooled"),
        replace(swung, condition="DBS", angle_rms_rad=3 * rad),
    )
    one = analysis(fits=(swung,), fixed_inertia=(swung,), pooled=pooled[:1], axis="vertical")
    assert one.stiffness_words == "measured at angle SD 2.00°, range up to 9.00°"
    weighed = replace(swung, findings=(Finding("gravity", "note", 1.4, np.nan),))
    fits = (weighed, replace(swung, angle_range_rad=12 * rad))
    two = analysis(fits=fits, fixed_inertia=fits, pooled=pooled)
    assert two.stiffness_words == (
        f"{weight} (K without it: note gravity); "
        "measured at angle SD 2.00° in OFF, 3.00° in DBS, range up to 12.0°"
    )
    assert two.stiffness_words in two._repr_html_().replace("&#x27;", "'")
    assert "VAF 99.6 %, angle SD 2.00°; epoch 1 OFF" in repr(
        replace(swung, vaf_percent=99.6, band_hz=(0.1, 30.0))
    )


def test_findings_of_one_check_are_told_once():
    ((found, fits, where),) = analysis().findings
    assert found.name == "frozen"
    assert [fit.epoch for fit in fits] == ["1", "2"]
    assert where == "both epochs"


def test_a_group_names_its_epochs_and_the_one_that_shows_it_most():
    fits = [
        replace(FIT, epoch=str(i), findings=(Finding("gravity", "note", v, 1.0),) if v else ())
        for i, v in enumerate((2.0, 2.0, 9.0, 0.0, 2.0), 1)
    ]
    (group,) = grouped(fits, ())
    assert (group.finding.value, group.where) == (9.0, "epochs 1–3, 5, most in epoch 3")
    assert group.line == f"note  gravity  {group.finding.headline}; {group.where}"


def test_a_notebook_shows_estimates_with_intervals_and_what_was_found():
    page = analysis()._repr_html_().replace("\N{NO-BREAK SPACE}", " ")
    assert "<th>K, N·m/rad</th>" in page
    assert "<td>3.00 ± 0.30</td>" in page
    assert "<td>3.00 ± 0.30 (2.40 to 3.60)</td>" in page
    assert "all epochs" in page
    assert "Check the sensor&#x27;s cable" in page
    assert "angle &lt;hung&gt;" in page
    assert "R² &lt; 0 &amp; worse" in page
    assert "<hung>" not in page
    assert "<th>work, J</th>" in page
    many = analysis(fits=(FIT,) * 50, fixed_inertia=(FIT,) * 50)
    assert "The first 20 of 50 epochs." in many._repr_html_()


def test_a_channel_lies_alike_in_memory_whatever_it_was_a_column_of():
    """Sums round by the layout, and a search may then end in another of two equal valleys."""
    table = np.arange(30.0).reshape(10, 3)
    channel = Channel("torque_nm", table[:, 0], table[:, 1])
    for column in (channel.time_s, channel.values):
        assert column.flags["C_CONTIGUOUS"]
        assert not column.flags["WRITEABLE"]
    np.testing.assert_array_equal(channel.values, table[:, 1])
    assert table.flags["WRITEABLE"]
