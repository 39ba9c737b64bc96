"""An emulated CiA 402 drive on a CAN bus."""
