"""
Does R find the same p values?
==============================

The table of estimates is a CSV file that R reads. Base R's rank-sum test of the epochs, its paired
t-test of the days and its analysis of variance with days as strata give the numbers of
``rm.compare``, to eight digits.

``make gallery`` runs this script; it needs R (``apt install r-base-core``).
"""

import json
import subprocess
from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np

import rigidimeter as rm

MEASURES = {
    "inertia_kg_m2": "J",
    "damping_nm_s_rad": "B",
    "stiffness_nm_rad": "K",
}

result = rm.compare(rm.data("study"))
folder = Path(mkdtemp())
table = result.study.analysis.table()
table = table[table["outcome"] == "included"]
table["day"] = table["source"].str.extract(r"day-(\d+)", expand=False)
table.to_csv(folder / "estimates.csv", index=False)
table[["day", "condition", "epoch", *MEASURES]].head(3)

# %%
# In R
# ----
#
# ``exact = FALSE`` is the test with correction for ties and continuity. The strata of ``aov`` are
# what belongs to a day, and what belongs to a condition on a day.

SCRIPT = """
epochs <- read.csv("estimates.csv", colClasses = c(day = "character"))
epochs$condition <- factor(epochs$condition, c("OFF", "DBS"))
epochs$day <- factor(epochs$day)
for (name in c("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")) {
  epochs$y <- epochs[[name]]
  off <- epochs$y[epochs$condition == "OFF"]
  dbs <- epochs$y[epochs$condition == "DBS"]
  ranks <- wilcox.test(off, dbs, exact = FALSE)
  means <- tapply(epochs$y, list(epochs$day, epochs$condition), mean)
  days <- t.test(means[, "OFF"], means[, "DBS"], paired = TRUE)
  strata <- summary(aov(y ~ condition + Error(day/condition), epochs))
  within <- strata[["Error: day:condition"]][[1]]
  numbers <- c(ranks$statistic, ranks$p.value, days$estimate, days$conf.int,
               days$p.value, within[1, "Pr(>F)"])
  cat(sprintf("[%s]\\n", paste(sprintf("%.15g", numbers), collapse = ", ")))
}
"""
(folder / "tests.R").write_text(SCRIPT)
run = subprocess.run(
    ["Rscript", "--vanilla", "tests.R"], cwd=folder, capture_output=True, text=True, check=True
)
of_r = [json.loads(line) for line in run.stdout.splitlines()]

# %%
# Side by side
# ------------
#
# How far each number of ``rm.compare`` is from that of R, relative to it. None is more than 1e-8,
# the dashed line; where both are equal the point is at 1e-17.

relative = []
for (name, letter), (w, p_ranks, mean, low, high, p_days, p_aov) in zip(
    MEASURES.items(), of_r, strict=True
):
    epochs, days = result.value_test(name), result.comparison(name)
    pairs = {
        "W": (epochs.statistic.u, w),
        "p, rank-sum": (epochs.p, p_ranks),
        "difference of days": (-days.difference, mean),
        "its lower end": (-days.high, low),
        "its upper end": (-days.low, high),
        "p, paired t-test": (days.p, p_days),
        "p, aov": (days.p, p_aov),
    }
    relative.append([max(abs(mine / theirs - 1), 1e-17) for mine, theirs in pairs.values()])
    print(f"{letter}: rank-sum p {p_ranks:.3g}, by days p {p_days:.3g}")

figure, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
for letter, row, shift in zip("JBK", relative, (-0.2, 0, 0.2), strict=True):
    axis.plot(row, np.arange(len(row)) + shift, "o", label=letter)
axis.set_yticks(range(len(pairs)), pairs)
axis.invert_yaxis()
axis.axvline(1e-8, color="black", lw=1, ls="--")
axis.set(xscale="log", xlabel="Relative difference from R (number)", xlim=(3e-18, 1e-6))
axis.legend(frameon=False, ncols=3)

assert np.max(relative) < 1e-8
