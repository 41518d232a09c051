"""Wires between processes: datagram sockets, LCM, Unitree's DDS, and the faults of a line."""
