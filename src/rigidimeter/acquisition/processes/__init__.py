"""The processes around the loop, the memory they share, and what they ask of the machine."""
