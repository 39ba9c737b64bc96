"""From recordings to conclusions: with no rig, and where there are no processes or sockets."""
