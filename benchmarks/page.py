"""How large a report's page is, and what opening it costs in a browser.

The time is that of the page's thread until the page is loaded, in processor time, which other work
on the machine hardly changes; the time on the clock stands beside it.

    python -m benchmarks.page study-report/report.html
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Sequence
from pathlib import Path

from tests.browser import open_browser

SCREEN = (1280, 800)


def opened(page: Path, repeats: int) -> list[tuple[float, float]]:
    """Return processor time and time on the clock until the page is loaded, in s, each time anew.

    Raises
    ------
    SystemExit
        Without a browser.
    """
    found = []
    with open_browser() as browser:
        for _ in range(repeats):
            tab = browser.new_page(viewport={"width": SCREEN[0], "height": SCREEN[1]})
            session = tab.context.new_cdp_session(tab)
            session.send("Performance.enable", {"timeDomain": "threadTicks"})
            tab.goto(page.resolve().as_uri())
            told = session.send("Performance.getMetrics")["metrics"]
            cpu_s = next(one["value"] for one in told if one["name"] == "TaskDuration")
            wall = "performance.getEntriesByType('navigation')[0].loadEventEnd / 1000"
            found.append((float(cpu_s), float(tab.evaluate(wall))))
            tab.close()
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print medians."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.page", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("page", type=Path, metavar="PAGE")
    parser.add_argument("--repeats", type=int, default=5, metavar="N")
    options = parser.parse_args(arguments)
    times = opened(options.page, options.repeats)
    cpu_s, wall_s = (statistics.median(part) for part in zip(*times, strict=True))
    print(f"{options.page}: {options.page.stat().st_size / 1e6:.2f} MB")
    print(f"loaded after {cpu_s:.2f} s of processor time, {wall_s:.2f} s on the clock")


if __name__ == "__main__":
    main()
