"""Flying for real: sockets, serial ports and clocks around the same corridor as everywhere else."""
