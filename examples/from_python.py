"""A complete experiment from Python: design, simulate, estimate, plot, compare, report.

    python examples/from_python.py OUT

OUT is a new folder. The subject is virtual, with the J, B and K of the settings below and the
defaults.
"""

from __future__ import annotations

import sys
from pathlib import Path

import rigidimeter as rm

SETTINGS = {
    "seed": 7,
    "subject": {"OFF": {}, "DBS": {"damping_nm_s_rad": 0.11}},
    "protocol": {
        "rests_s": [5.0],
        "blocks": [
            {"task": "prbs", "condition": "OFF", "epochs": 3},
            {"task": "prbs", "condition": "DBS", "epochs": 3},
        ],
    },
}


def main(out: Path) -> None:
    """Run the example in a new folder."""
    out.mkdir(parents=True)

    # Stability of the loop and predicted standard errors of J, B and K.
    plan = rm.design(SETTINGS)
    print(plan.table())
    plan.plot()[0].figure.savefig(out / "perturbation.png")

    # Run a session on the virtual rig and read its epochs.
    recording = rm.simulate(SETTINGS, out / "session")

    # Estimate one epoch from plain arrays.
    epoch = recording.epochs[0]
    channels = {name: channel.values for name, channel in epoch.channels.items()}
    fit = rm.identify(
        torque_nm=channels["torque_nm"],
        angle_rad=channels["angle_rad"],
        velocity_rad_s=channels["velocity_rad_s"],
        perturbation_nm=channels["perturbation_nm"],
        rate_hz=1000.0,
    )
    print(fit)  # J, B and K ± one standard error

    # Estimate every epoch, compare the two conditions, and write a report.
    estimates = rm.estimate(recording)
    print(estimates.table().drop(columns="source"))
    estimates.plot()[0].figure.savefig(out / "estimates.png")
    print(rm.compare(estimates).table().T)
    print(rm.report(recording, out / "report"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
