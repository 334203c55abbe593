"""What runs against the clock of the wall: sockets, processes, loops."""
