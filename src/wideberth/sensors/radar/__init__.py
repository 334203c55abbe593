"""Radar: how far it sees, from the link budget to a confirmed track."""
