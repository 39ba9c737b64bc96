"""CiA 402 servos over CANopen, in profile-velocity mode."""
