"""From epochs to J, B and K: offline and pure."""
