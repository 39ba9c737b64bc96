"""A CiA 402 drive node on a CAN bus."""
