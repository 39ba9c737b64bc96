"""From epochs to J, B and K, to scores, and to what else the torque holds: offline and pure."""
