"""Counter-based noise: the generator's published answers, and its distributions."""

import math

import numpy as np
import pytest

from wideberth.sensors.noise_kernels import fill_normals, fill_uniforms, philox


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        ((0, 0, 0, 0, 0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 6, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_known_answers(words, answer):
    """Test vectors of Philox 4x32-10 as its authors publish them."""
    assert tuple(int(w) for w in philox(*(np.uint64(w) for w in words))) == answer


def test_distributions():
    n = 4000
    uniform, normal = np.empty(n), np.empty(n)
    fill_uniforms(5, 1, 2, 3, 0, uniform)
    fill_normals(5, 1, 2, 3, 0, normal)
    # Five standard errors each: a wrong build fails, one draw in a million does.
    assert abs(uniform.mean() - 0.5) < 5 * math.sqrt(1 / 12 / n)
    assert uniform.min() > 0.0 and uniform.max() < 1.0
    assert abs(normal.mean()) < 5 / math.sqrt(n)
    assert abs(normal.var() - 1.0) < 5 * math.sqrt(2 / n)


def test_streams_differ_in_each_part_of_the_key():
    first = (1, 1, 1, 1)
    keys = [first, *((*first[:i], 2, *first[i + 1 :]) for i in range(4)), (1 + 2**40, 1, 1, 1), (1, 1, 1 + 2**40, 1)]
    drawn = np.empty((len(keys), 4))
    for key, out in zip(keys, drawn, strict=True):
        fill_uniforms(*key, 0, out)
    assert len(np.unique(drawn)) == drawn.size


def test_any_block_can_be_had_alone():
    whole, part = np.empty(12), np.empty(4)
    fill_normals(7, 3, 9, 2, 0, whole)
    fill_normals(7, 3, 9, 2, 2, part)
    np.testing.assert_array_equal(part, whole[8:])
