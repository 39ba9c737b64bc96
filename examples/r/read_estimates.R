# Read what rigidimeter estimated, and write a recording for it. Base R alone.
#
#   rigidimeter estimate SESSION --csv estimates.csv
#   Rscript read_estimates.R estimates.csv
#
# One row for each epoch; units stand in every name; an empty cell is "not estimated".
read_estimates <- function(file) {
  epochs <- read.csv(file, na.strings = "", colClasses = c(epoch = "character"))
  epochs[epochs$outcome == "included", ]
}

file <- commandArgs(trailingOnly = TRUE)[1]
epochs <- read_estimates(file)
print(aggregate(cbind(inertia_kg_m2, damping_nm_s_rad, stiffness_nm_rad) ~ condition, epochs, median))

# The other way: a recording of ours for `rigidimeter estimate mine.csv`.
time_s <- (0:9999) / 1000
angle_rad <- 0.05 * sin(2 * pi * 0.7 * time_s) + 0.03 * sin(2 * pi * 2.3 * time_s) + 0.01 * sin(2 * pi * 6.1 * time_s)
slope <- function(x) c(x[2] - x[1], (x[-(1:2)] - x[-((length(x) - 1):length(x))]) / 2, x[length(x)] - x[length(x) - 1]) * 1000
torque_nm <- 0.005 * slope(slope(angle_rad)) + 0.14 * slope(angle_rad) + 1.8 * angle_rad
torque_nm <- torque_nm + 0.01 * rnorm(length(torque_nm)) # in place of a sensor
write.csv(data.frame(time_s, torque_nm, angle_rad), "mine.csv", row.names = FALSE)
