"""What moves the arm: guard, devices, the loop of a session, commissioning, and the console."""
