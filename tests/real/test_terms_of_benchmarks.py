"""Model terms on measured systems whose parameters are published or known from both parts."""

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import fit_terms
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import parse_settings

JBK = "inertia,damping,stiffness,offset"
HIGH_HZ = 40.0


def recorded(torque_nm, angle_rad, rate_hz, trim_s=1.0):
    """Return a recording on one clock, as those who published its parameters took it."""
    time_s = np.arange(torque_nm.size) / rate_hz
    channels = {
        name: Channel(name, time_s, np.ascontiguousarray(values, dtype=float))
        for name, values in (("torque_nm", torque_nm), ("angle_rad", angle_rad))
    }
    settings = parse_settings({"estimation": {"trim_s": trim_s, "correct_delay": False}})
    return Recording((Epoch("r", "1", channels, task="prbs"),), (), settings, ())


def fitted(recording, terms, high_hz=HIGH_HZ):
    (epoch,) = fit_terms(recording, terms, high_hz=high_hz).epochs
    assert epoch.models is not None, epoch.problem
    (row,) = epoch.models.compared.rows
    assert row.fit is not None, row.problem
    return row.fit


def compared(recording, models):
    (epoch,) = fit_terms(recording, models, compare=True, high_hz=HIGH_HZ).epochs
    assert epoch.models is not None, epoch.problem
    return epoch.models.compared


def ankle(shared_data, name):
    with np.load(shared_data / "ankle" / f"{name}.npz") as archive:
        return recorded(-archive["torque_Nm"], archive["position_rad"], 1000.0)


@pytest.fixture
def emps(shared_data):
    data = scipy.io.loadmat(shared_data / "emps" / "DATA_EMPS.mat")
    force = float(data["gtau"].ravel()[0]) * data["vir"].ravel()
    return recorded(force, data["qm"].ravel(), 1000.0, trim_s=0.25)


def test_the_axis_has_its_published_mass_and_friction(emps):
    fit = fitted(emps, "inertia,damping,coulomb,offset")
    published = {
        "inertia": (95.1089, 0.1085),
        "damping": (203.5034, 1.1460),
        "coulomb": (20.3935, 0.1012),
        "offset": (-3.1648, 0.0444),
    }
    for term, (value, sd) in published.items():
        print(term, fit.of(term).value, (fit.of(term).value - value) / sd)
        assert abs(fit.of(term).value - value) < sd, term


def test_the_axis_has_its_published_friction_in_each_direction(emps):
    fit = fitted(emps, "inertia,directional-damping,directional-coulomb")
    assert abs(fit.of("inertia").value - 95.1540) < 2 * 0.0827
    published = {"damping+": 166.71, "coulomb+": 20.14, "damping-": 240.42, "coulomb-": 20.63}
    # Their deviations were not published; those of the undirected terms stand in.
    for term, value in published.items():
        sd = 1.1460 if term.startswith("damping") else 0.1012
        print(term, fit.of(term).value, (fit.of(term).value - value) / sd)
        assert abs(fit.of(term).value - value) < 2 * sd, term


@pytest.mark.parametrize("name", ["z_df", "z_df2", "z_pf"])
@pytest.mark.parametrize("reflex", ["reflex-fir+", "reflex-second-order+"])
def test_a_reflex_predicts_blocks_that_it_has_not_seen(shared_data, name, reflex):
    found = compared(ankle(shared_data, name), [JBK, f"{JBK},{reflex}"])
    plain, with_reflex = found.rows
    print(name, reflex, plain.held_out_vaf_percent, with_reflex.held_out_vaf_percent)
    assert with_reflex.fit is not None
    assert with_reflex.held_out_vaf_percent > max(plain.held_out_vaf_percent, 97.0)
    assert found.recommended is with_reflex


def test_the_wrong_direction_and_no_reflex_show_themselves(shared_data):
    models = [JBK, f"{JBK},reflex-fir+", f"{JBK},reflex-fir-"]
    plain, right, wrong = rows = compared(ankle(shared_data, "z_pf"), models).rows
    print([row.held_out_vaf_percent for row in rows])
    assert plain.fit is not None
    assert right.fit is not None
    # Of what the right one leaves, the wrong one leaves more than twice as much.
    assert 100 - wrong.held_out_vaf_percent > 2 * (100 - right.held_out_vaf_percent)
    assert "it pushes" in wrong.problem
    ratio = plain.fit.of("stiffness").value / right.fit.of("stiffness").value
    print("K without / with", ratio)
    assert ratio > 1.6


def test_the_data_find_the_direction(shared_data):
    fit = fitted(ankle(shared_data, "z_pf"), f"{JBK},reflex-second-order")
    assert 0.035 < fit.of("reflex-second-order+ delay").value < 0.08


class TestSilverbox:
    """m y″ + d y′ + a y + b y³ = u about an unknown middle: hence the square and the offset."""

    RATE_HZ = 610.3516
    HIGH_HZ = 120.0
    LINEAR = "inertia,damping,stiffness,offset"
    WHOLE = f"{LINEAR},quadratic,cubic"

    @pytest.fixture
    def parts(self, shared_data):
        table = np.genfromtxt(
            shared_data / "silverbox" / "SNLS80mV.csv", delimiter=",", skip_header=1
        )[:, :2]
        return {
            name: recorded(*table[part].T, self.RATE_HZ, trim_s=0.5)
            for name, part in (
                ("noise", slice(0, 40_000)),
                ("multisine", slice(40_800, None)),
                ("all", slice(None)),
            )
        }

    @pytest.mark.parametrize("name", ["noise", "multisine", "all"])
    def test_a_cubic_spring_explains_it(self, parts, name):
        linear = fitted(parts[name], self.LINEAR, self.HIGH_HZ)
        whole = fitted(parts[name], self.WHOLE, self.HIGH_HZ)
        print(name, linear.vaf_percent, whole.vaf_percent)
        assert whole.vaf_percent > 99.99
        assert 100 - linear.vaf_percent > 100 * (100 - whole.vaf_percent)

    def test_both_parts_have_the_same_parameters(self, parts):
        noise, multisine = (
            fitted(parts[name], self.WHOLE, self.HIGH_HZ) for name in ("noise", "multisine")
        )
        for term in ("inertia", "damping", "stiffness", "cubic"):
            print(term, noise.of(term).value, multisine.of(term).value)
            assert multisine.of(term).value == pytest.approx(noise.of(term).value, rel=0.01)
