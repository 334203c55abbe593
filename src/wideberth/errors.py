"""Errors that are shown to people as one line that says what to do."""


class InputError(ValueError):
    """Something given from outside (file, option, configuration, address) that cannot be used."""
