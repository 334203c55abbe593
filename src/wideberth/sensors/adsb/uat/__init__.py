"""UAT (978 MHz): the messages of aircraft, as receivers hand them on after error correction (RTCA DO-282B)."""
