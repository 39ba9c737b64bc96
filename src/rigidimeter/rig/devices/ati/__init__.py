"""ATI force/torque sensors: over the network (RDT), and analogue through a DAQ card."""
