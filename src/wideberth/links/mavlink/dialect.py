"""The messages of MAVLink 2, by pymavlink."""

from wideberth.errors import InputError

try:
    from pymavlink.dialects.v20 import ardupilotmega as mavlink
except ImportError as error:
    raise InputError("MAVLink needs pymavlink: pip install 'wideberth[links]'") from error

__all__ = ["mavlink"]
