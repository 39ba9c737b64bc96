import numpy as np
import pytest

from rigidimeter.estimation import fit_epochs
from rigidimeter.estimation.closedloop.line_noise import drawn_lines

NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


def test_drawn_errors_scatter_as_the_textbook_says():
    rng = np.random.default_rng(0)
    m, density = 2000, 3.0
    design = rng.standard_normal((m, 2)) + 1j * rng.standard_normal((m, 2))
    noise = np.sqrt(density / 2) * (rng.standard_normal(m) + 1j * rng.standard_normal(m))
    inverse = np.linalg.inv((design.conj().T @ design).real)
    drawn = drawn_lines(inverse, design, noise, rng, 2000)
    np.testing.assert_allclose(drawn.var(0), density / 2 * np.diag(inverse), rtol=0.12)
    assert np.all(np.abs(drawn.mean(0)) < 4 * drawn.std(0) / np.sqrt(2000))


@pytest.mark.parametrize("n", [4, 12])
def test_the_bootstrap_is_near_the_other_intervals(simulated, n):
    settings, epochs = simulated(n)
    chosen = settings.model_copy(
        update={"estimation": settings.estimation.model_copy(update={"intervals": "bootstrap"})}
    )
    for one, other in zip(
        [fits[-1] for fits in fit_epochs(epochs, "iv", settings)],
        [fits[-1] for fits in fit_epochs(epochs, "iv", chosen)],
        strict=True,
    ):
        for name in NAMES:
            assert getattr(one, name) == getattr(other, name)
            width, drawn = (
                getattr(fit, f"{name}_high") - getattr(fit, f"{name}_low") for fit in (one, other)
            )
            assert 0.5 < drawn / width < 1.5
            assert drawn != width
