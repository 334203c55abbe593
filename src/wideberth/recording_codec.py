"""How the values of `types` become bytes in a recording and back, exact to the last bit."""

import functools
import struct
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
T = TypeVar("T")

ARRAY_CODE = 1
PACKED_SYMMETRIC = 0x80
_ELEMENT = np.dtype("<f8")

ARRAY_TEXT = f"""Encoding: msgpack. A record is a map of its fields' names. Units: SI, radians, local NED.
An array is an extension of type {ARRAY_CODE}: one byte with the number of dimensions (plus {PACKED_SYMMETRIC} where the
last two are a symmetric matrix of which only the upper triangle, row by row, is stored), the shape as little-endian
uint32, then the elements as little-endian float64.
"""


@functools.cache
def _upper(n: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    rows, columns = np.triu_indices(n)
    return rows, columns, rows * n + columns


@functools.lru_cache(maxsize=1024)
def _head(shape: tuple[int, ...], packed: int) -> bytes:
    return bytes([len(shape) | packed]) + struct.pack(f"<{len(shape)}I", *shape)


def _pack_array(array: NDArray[Any]) -> bytes:
    a = array if array.dtype == _ELEMENT else array.astype(_ELEMENT)
    shape: tuple[int, ...] = a.shape
    data = a.tobytes()
    if len(shape) >= 2 and shape[-1] == shape[-2] > 1 and data == a.swapaxes(-1, -2).tobytes():
        # Equal as bits: NaN and the sign of zero count.
        upper = a.reshape(*shape[:-2], shape[-1] ** 2).take(_upper(shape[-1])[2], axis=-1)
        return _head(shape, PACKED_SYMMETRIC) + upper.tobytes()
    return _head(shape, 0) + data


def _unpack_array(data: bytes | memoryview) -> FloatArray:
    dimensions = data[0] & ~PACKED_SYMMETRIC
    shape = struct.unpack_from(f"<{dimensions}I", data, 1)
    values = np.frombuffer(data, "<f8", offset=1 + 4 * dimensions)
    # Copies, so that the arrays are aligned and writable as they were.
    if not data[0] & PACKED_SYMMETRIC:
        return values.reshape(shape).astype(np.float64)
    rows, columns, _ = _upper(shape[-1])
    a = np.empty(shape)
    a[..., rows, columns] = a[..., columns, rows] = values.reshape(*shape[:-2], len(rows))
    return a


def encode_other(value: object) -> object:
    """Return what stands in msgpack for a value that it does not know: an array, a numpy number, a mapping."""
    if isinstance(value, np.ndarray):
        return msgspec.msgpack.Ext(ARRAY_CODE, _pack_array(value))
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return dict(value)
    raise NotImplementedError(f"a {type(value).__name__} cannot be recorded")


def _decode_extension(code: int, data: memoryview) -> object:
    if code != ARRAY_CODE:
        raise ValueError(f"unknown extension {code}")
    return _unpack_array(data)


def _decode_other(kind: type, value: object) -> object:
    # The array type of `types` reaches here; the extension hook has already made the array.
    if isinstance(value, np.ndarray):
        return value
    raise ValueError(f"expected {kind}, not a {type(value).__name__}")


_ENCODER = msgspec.msgpack.Encoder(enc_hook=encode_other)


def decoder(kind: type[T]) -> "msgspec.msgpack.Decoder[T]":
    """Return a decoder of recorded values of one type; it raises `msgspec.DecodeError` or ValueError on others."""
    return msgspec.msgpack.Decoder(kind, dec_hook=_decode_other, ext_hook=_decode_extension)


def encode(value: object) -> bytes:
    """Return the recorded form of one of the values of `wideberth.types`: equal bytes mean equal to the last bit."""
    return _ENCODER.encode(value)


def describe(*kinds: type) -> str:
    """Return the fields of dataclasses and their types in words, for people who read the file with another tool."""
    lines = []
    for kind in kinds:
        assert is_dataclass(kind)
        lines.append(f"{kind.__name__.lstrip('_')}:")
        lines += [f"  {f.name}: {f.type if isinstance(f.type, str) else _type_name(f.type)}" for f in fields(kind)]
    return "\n".join(lines)


def _type_name(kind: object) -> str:
    text = getattr(kind, "__name__", "") if isinstance(kind, type) and not getattr(kind, "__args__", ()) else str(kind)
    return "array of float64" if "ndarray" in text else text.replace("wideberth.types.", "")
