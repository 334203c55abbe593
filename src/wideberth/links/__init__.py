"""What comes in over wires and goes out: protocols as bytes in and values out, without sockets and clocks."""
