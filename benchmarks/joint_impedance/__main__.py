"""Make the recordings, estimate with every package, write the page.

    python -m benchmarks.joint_impedance                         # the page from the stored results
    python -m benchmarks.joint_impedance --packages              # every package on every recording
    python -m benchmarks.joint_impedance --packages lstsq --only relaxed --recordings 2
    python -m benchmarks.joint_impedance --recordings-to FOLDER  # the recordings as files
    python -m benchmarks.joint_impedance --make-truth            # truth and digests anew

The results and the page are written when a package has been run on every recording. Each recording
is checked against its digest. A fifth of a gigabyte of files and some minutes a package.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.joint_impedance import packages, page, recordings, score
from benchmarks.joint_impedance.measure import checked, measured, stored, write_results

RESULTS = Path(__file__).with_name("results")
PAGE = Path(__file__).parents[2] / "docs" / "reference" / "joint-impedance-benchmark.md"


def main() -> None:
    """Do what the arguments ask, and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--packages", nargs="*", choices=[*packages.PACKAGES], metavar="NAME")
    parser.add_argument("--only", nargs="+", choices=[*recordings.SCENARIOS], metavar="SCENARIO")
    parser.add_argument("--recordings", type=int, default=recordings.RECORDINGS)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--recordings-to", type=Path, metavar="FOLDER")
    parser.add_argument("--make-truth", action="store_true")
    options = parser.parse_args()
    names = dict.fromkeys(options.only or recordings.SCENARIOS, options.recordings)
    if options.make_truth:
        recordings.write_truth()
    if options.recordings_to:
        options.recordings_to.mkdir(parents=True, exist_ok=True)
        for name, count in names.items():
            for made in (checked(name, number) for number in range(1, count + 1)):
                (options.recordings_to / made.name).write_text(made.text, encoding="utf-8")
    whole = names == dict.fromkeys(recordings.SCENARIOS, recordings.RECORDINGS)
    found = stored(RESULTS)
    if options.packages is not None:
        found = measured(options.packages or [*packages.PACKAGES], names, options.jobs)
        if whole:
            for package, rows in found.items():
                write_results(package, rows, RESULTS)
            found = stored(RESULTS)
    truth = recordings.truth_rows()
    scores = {package: score.scores(rows, truth) for package, rows in found.items()}
    print("\n".join(page.table(scores)))
    if whole and not options.recordings_to:
        PAGE.write_text(page.page(scores), encoding="utf-8")


if __name__ == "__main__":
    main()
