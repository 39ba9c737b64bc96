"""An open benchmark of estimates of a joint's inertia, damping and stiffness; see README.md."""
