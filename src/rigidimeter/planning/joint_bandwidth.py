"""How fast the joint can answer: the −3 dB frequency over what is not known of it (App. A).

The paper takes a second-order arm with ±50 % on inertia, damping and stiffness and reports the
corner −50 %, −50 %, −50 % as the one with the largest bandwidth (Eq. 8),

    1 / (0.0026 s² + 0.044 s + 0.75)

whose −3 dB frequency is 3.44 Hz ("3.5 Hz"). It is not the largest: with the stiffness at +50 % the
joint answers up to 6.84 Hz. It is not even larger than the nominal one, since one factor on all
three leaves the shape of the response as it is. Both corners are below the 10 Hz to which the
perturbation reaches, and both are reported.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

from rigidimeter.core.errors import UserError
from rigidimeter.model import JointDynamics

APPENDIX_A = JointDynamics(inertia_kg_m2=0.0052, damping_nm_s_rad=0.088, stiffness_nm_rad=1.5)
"""The nominal arm with robot and controller of App. A, of which Eq. 8 is half in each value.

The damping is the sum of 0.06 (elbow) and 0.028 (controller); the 0.0088 that is printed is a slip,
as half of 0.088 in Eq. 8 shows. The printed inertia 0.0052 is kept because Eq. 8 uses it, although
its printed parts (forearm 8.6625e-4, robot 4e-3, controller 8e-4) sum to 0.00567. App. A also takes
the controller per radian where Sec. 2.4.2 gives it per degree.
"""

FOREARM_SHARE = 0.015
ROBOT_INERTIA_KG_M2 = 4e-3
CONTROLLER_INERTIA_KG_M2 = 8e-4
"""App. A: the forearm's share of the body's mass, and the parts of the inertia beside it."""

_EQUATION_8_SIGNS = (-1, -1, -1)
"""The corner (of J, B, K) that the paper calls the one with the largest bandwidth."""


class Forearm(NamedTuple):
    """A forearm as App. A takes it: 1.5 % of the body's mass, a rod that turns about its end.

    Without values it is that of App. A, whose length is not printed: 150 mm give its inertia.

    Raises
    ------
    UserError
        By `arm`, if mass or length are not those of a body.
    """

    body_mass_kg: float = 7.7
    length_m: float = 0.150

    @property
    def mass_kg(self) -> float:
        """Its own mass."""
        return FOREARM_SHARE * self.body_mass_kg

    @property
    def inertia_kg_m2(self) -> float:
        """Its inertia about the elbow, m l²/3."""
        return self.mass_kg * self.length_m**2 / 3.0

    def arm(self) -> JointDynamics:
        """Return the arm of App. A with this forearm; its inertia is the sum of its parts."""
        for what, value, max_value, unit in (
            ("body mass", self.body_mass_kg, 500.0, "kg"),
            ("forearm", self.length_m, 1.0, "m"),
        ):
            if not 0.0 < value <= max_value:
                raise UserError(
                    f"a {what} of {value:g} {unit} is not possible; it must be above 0 and at "
                    f"most {max_value:g} {unit}"
                )
        total = self.inertia_kg_m2 + ROBOT_INERTIA_KG_M2 + CONTROLLER_INERTIA_KG_M2
        return replace(APPENDIX_A, inertia_kg_m2=total)


@dataclass(frozen=True)
class Corner:
    """A joint at one combination of extremes.

    Attributes
    ----------
    signs : (int, int, int)
        Whether J, B and K are at the upper (+1), the lower (−1) or the nominal (0) value.
    joint : JointDynamics
        The values.
    bandwidth_hz : float
        Where its compliance is 3 dB below that at rest.
    """

    signs: tuple[int, int, int]
    joint: JointDynamics
    bandwidth_hz: float


@dataclass(frozen=True)
class Corners:
    """The nominal joint and its eight corners, from (−, −, −) to (+, +, +)."""

    uncertainty_percent: float
    nominal: Corner
    corners: tuple[Corner, ...]

    @property
    def equation_8(self) -> Corner:
        """The corner of Eq. 8, all three at the lower value: the paper's worst case."""
        return next(corner for corner in self.corners if corner.signs == _EQUATION_8_SIGNS)

    @property
    def widest(self) -> Corner:
        """The corner with the largest bandwidth."""
        return max(self.corners, key=lambda corner: corner.bandwidth_hz)


def corners(nominal: JointDynamics = APPENDIX_A, uncertainty_percent: float = 50.0) -> Corners:
    """Return the bandwidth of a joint and of its eight corners.

    Parameters
    ----------
    nominal : JointDynamics
        With a stiffness greater than zero.
    uncertainty_percent : float
        How far each of J, B and K may be off, in percent; at least 0 and below 100.

    Raises
    ------
    ValueError
        If the uncertainty is out of range or the stiffness is not greater than zero.
    """
    if not 0.0 <= uncertainty_percent < 100.0:
        raise ValueError(f"uncertainty must be 0 to below 100 %, got {uncertainty_percent}")
    share = uncertainty_percent / 100.0
    signs = [(J, B, K) for J, B, K in itertools.product((-1, 1), repeat=3)]
    at_corners = tuple(_corner(nominal, share, one) for one in signs)
    return Corners(uncertainty_percent, _corner(nominal, share, (0, 0, 0)), at_corners)


def _corner(nominal: JointDynamics, share: float, signs: tuple[int, int, int]) -> Corner:
    joint = JointDynamics(
        nominal.inertia_kg_m2 * (1.0 + signs[0] * share),
        nominal.damping_nm_s_rad * (1.0 + signs[1] * share),
        nominal.stiffness_nm_rad * (1.0 + signs[2] * share),
    )
    return Corner(signs, joint, joint.bandwidth_hz())
