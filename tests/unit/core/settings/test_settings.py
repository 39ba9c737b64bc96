import math
import re

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import (
    Settings,
    changed_settings,
    dump_settings,
    load_settings,
    parse_settings,
)


def test_the_controller_is_read_per_degree():
    # 0.0008 kg·m²/deg and 0.028 N·m·s/deg are 180/π times as much per radian.
    controller = Settings().controller
    assert controller.inertia_kg_m2 == pytest.approx(0.0008 * 180 / math.pi, rel=1e-14)
    assert controller.damping_nm_s_rad == pytest.approx(0.028 * 180 / math.pi, rel=1e-14)
    assert round(controller.inertia_kg_m2, 4) == 0.0458
    assert round(controller.damping_nm_s_rad, 3) == 1.604


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"controller": {"inertia_kg_m2": -1.0}},
            "controller.inertia_kg_m2 = -1.0: Input should be greater than 0, in kg·m²",
        ),
        (
            {"rig": {"torque": {"rate_hz": "fast"}}},
            "rig.torque.rate_hz = 'fast': Input should be a valid number, in Hz",
        ),
        (
            {"prbs": {"register_bits": 21}},
            "prbs.register_bits = 21: Input should be less than or equal to 20",
        ),
        (
            {"subject": {"OFF": {"damping_nm_s_rad": math.nan}}},
            "subject.OFF.damping_nm_s_rad = nan: Input should be a finite number, in N·m·s/rad",
        ),
        (
            {"protocol": {"blocks": [{"task": "prb"}]}},
            "protocol.blocks[0].task = 'prb': Input should be 'prbs' or 'sinusoid'",
        ),
        ({"prbs": 3}, "prbs = 3: Input should be a table, as in [prbs]"),
        (
            {"protocol": {"rests_s": [10.0, "a"]}},
            "protocol.rests_s[1] = 'a': Input should be a valid number, in s",
        ),
        (
            {"protocol": {"rests_s": [-1.0]}},
            "rests_s holds -1 s; each rest, which begins after the return, must last from 0",
        ),
        (
            {"protocol": {"blocks": [{"condition": "X"}]}},
            "names condition 'X', but there is no [subject.X]",
        ),
        ({"sinusoid": {"amplitude_deg": 60.0}}, "must stay below guard.position_limit_deg"),
        ({"guard": {"reaction_time_s": 0.001}}, "is shorter than this rig may take to react"),
        ({"rig": {"torque": {"rate_hz": 2000.0}}}, "must not exceed rig.tick_rate_hz"),
        *(
            ({table: {low: 2.0, high: 2.0}}, f"{table}: {low} must be below {high}")
            for table, low, high in (
                ("prbs", "wanted_low_hz", "wanted_high_hz"),
                ("estimation", "band_low_hz", "band_high_unknown_hz"),
                ("scores", "band_low_hz", "band_high_hz"),
                ("diagnostics", "voluntary_low_hz", "voluntary_high_hz"),
                ("diagnostics", "min_inertia_kg_m2", "max_inertia_kg_m2"),
                ("online", "band_low_hz", "band_high_hz"),
            )
        ),
        (
            {"subject": {"OFF": {"voluntary_low_hz": 5.0}}},
            "subject.OFF: voluntary_low_hz must be below voluntary_high_hz",
        ),
    ],
)  # fmt: skip
def test_a_bad_value_is_answered_with_key_value_unit_and_range(values, sentence):
    with pytest.raises(UserError, match=re.escape(sentence)):
        parse_settings(values)


@pytest.mark.parametrize(
    ("values", "nearest"),
    [
        ({"controller": {"inertia_kgm2": 1.0}}, "controller.inertia_kg_m2"),
        ({"contoller": {}}, "controller"),
        ({"rig": {"torque": {"noise_nm": 1.0}}}, "rig.torque.noise_sd_nm"),
        ({"protocol": {"blocks": [{"condtion": "A"}]}}, "protocol.blocks[0].condition"),
        ({"subject": {"OFF": {"stifness_nm_rad": 1.0}}}, "subject.OFF.stiffness_nm_rad"),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest_known_one(values, nearest):
    with pytest.raises(UserError, match=re.escape(f"is not a setting; the nearest is {nearest} ")):
        parse_settings(values)


def test_every_mistake_is_named_at_once():
    with pytest.raises(UserError) as caught:
        parse_settings({"prbs": {"clock_hz": -1.0}, "seed": -4})
    assert "prbs.clock_hz" in str(caught.value)
    assert "seed" in str(caught.value)


def test_settings_survive_a_round_trip():
    settings = parse_settings({"seed": 5, "subject": {"A": {}}, "protocol": {
        "blocks": [{"condition": "A", "epochs": 2}]}})  # fmt: skip
    assert parse_settings(dump_settings(settings)) == settings


def test_a_file_is_read_and_named_when_it_is_wrong(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("seed = 3\n[controller]\ninertia_kg_m2 = 0.05\n")
    assert load_settings(path).controller.inertia_kg_m2 == 0.05
    path.write_text("seed = \n")
    with pytest.raises(UserError, match=r"rig\.toml: is not valid TOML"):
        load_settings(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match="UTF-8"):
        load_settings(path)
    with pytest.raises(UserError, match="cannot be read"):
        load_settings(tmp_path / "none.toml")


def test_every_number_states_its_unit():
    """A unit in the key is the only defence against the paper's own slip of units."""

    def walk(model, prefix=""):
        for name, field in model.model_fields.items():
            inner = field.annotation
            if hasattr(inner, "model_fields"):
                walk(inner, f"{prefix}{name}.")
            elif inner in (int, float):
                unit = (field.json_schema_extra or {}).get("unit")
                assert unit, f"{prefix}{name} has no unit"
                suffix = {"1": "", "%": "_percent"}.get(unit)
                if suffix is None:
                    ending = unit.replace("·", "_").replace("²", "2").replace("µ", "u")
                    ending = ending.replace("/", "_").lower()
                    ending = {"1_s": "per_s", "uv_(n_m)": "uv_per_nm"}.get(ending, ending)
                    assert name.endswith(ending.replace("n_m", "nm")), f"{prefix}{name}: {unit}"
                else:
                    assert name.endswith(suffix)

    walk(Settings)


@pytest.mark.parametrize("name", ["torque", "motion"])
def test_a_stamp_that_takes_off_too_much_makes_a_reading_old(name):
    """The guard goes by the stamp: 0.06 s old at most by it, however short the latency is."""
    sensor = {"rate_hz": 100.0, "latency_s": 0.001, "stamp_latency_s": 0.05}
    values = {"rig": {name: sensor}, "guard": {"reaction_time_s": 0.2, "stale_s": 0.055}}
    with pytest.raises(UserError, match=rf"too short for rig\.{name}, .* may be 0\.06 s old"):
        parse_settings(values)
    values["guard"]["stale_s"] = 0.065
    parse_settings(values)


def test_a_change_leaves_the_other_defaults_unstated_and_the_default_subjects_there():
    changed = changed_settings(Settings(), {"subject": {"X": {}}, "prbs": {"amplitude_nm": 0.5}})
    assert set(changed.subject) == {"OFF", "DBS", "X"}
    assert changed.model_fields_set == {"subject", "prbs"}
