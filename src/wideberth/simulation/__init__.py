"""Worlds: truth, traffic, missions, clocks and what flies in them."""
