"""The random numbers of the C++ library (host/model/random.hpp), number for number.

Trials drawn here are those that the documents' figures are of.
"""

import math
from enum import IntEnum

import numpy
from numpy.typing import NDArray

_SIZE = 312  # words of the engine's state
_SHIFT = 156
_UPPER = numpy.uint64(0xFFFFFFFF80000000)
_LOWER = numpy.uint64(0x7FFFFFFF)
_TWIST = numpy.uint64(0xB5026F5AA96619E9)


class Stream(IntEnum):
    """Purpose of random numbers; each has a stream of its own for the same seed."""

    OBJECT_POSE = 2
    TOUCH_ORDER = 3
    POSE_NOISE = 5


def seed_sequence(seeds: list[int], n: int) -> list[int]:
    """The n >= 623 words that std::seed_seq{seeds...} generates."""
    words = [0x8B8B8B8B] * n
    p, q, s = (n - 11) // 2, (n - 11) // 2 + 11, len(seeds)
    for k in range(2 * n):
        here, middle, before = words[k % n], words[(k + p) % n], words[(k - 1) % n]
        if k < n:
            mixed = here ^ middle ^ before
            first = 1664525 * (mixed ^ mixed >> 27) & 0xFFFFFFFF
            second = first + (s if k == 0 else k + seeds[k - 1] if k <= s else k)
            words[(k + p) % n] = middle + first & 0xFFFFFFFF
            words[(k + q) % n] = words[(k + q) % n] + second & 0xFFFFFFFF
        else:
            mixed = here + middle + before & 0xFFFFFFFF
            first = 1566083941 * (mixed ^ mixed >> 27) & 0xFFFFFFFF
            second = first - k % n
            words[(k + p) % n] = middle ^ first
            words[(k + q) % n] ^= second & 0xFFFFFFFF
        words[k % n] = second & 0xFFFFFFFF
    return words


class MersenneTwister:
    """std::mt19937_64 (Matsumoto and Nishimura 1998), whose numbers come in blocks of 312."""

    def __init__(self, state: NDArray[numpy.uint64]) -> None:
        self._state = state
        self._left: NDArray[numpy.uint64] = numpy.empty(0, numpy.uint64)

    def draw(self, n: int) -> NDArray[numpy.uint64]:
        """The next n numbers, [n]."""
        blocks = [self._block() for _ in range(-(-(n - len(self._left)) // _SIZE))]
        self._left = numpy.concatenate([self._left, *blocks])
        drawn, self._left = self._left[:n], self._left[n:]
        return drawn

    def _block(self) -> NDArray[numpy.uint64]:
        x: NDArray[numpy.uint64] = self._state
        # Each half needs only words that the other half has, but for the last, which needs the first.
        for begin in (0, _SHIFT):
            here: NDArray[numpy.int64] = numpy.arange(begin, begin + _SHIFT)
            for part in (here[:-1], here[-1:]):
                joined = (x[part] & _UPPER) | (x[(part + 1) % _SIZE] & _LOWER)
                odd = (joined & numpy.uint64(1)) * _TWIST
                x[part] = x[(part + _SHIFT) % _SIZE] ^ (joined >> numpy.uint64(1)) ^ odd
        y: NDArray[numpy.uint64] = numpy.array(x)
        y ^= (y >> numpy.uint64(29)) & numpy.uint64(0x5555555555555555)
        y ^= (y << numpy.uint64(17)) & numpy.uint64(0x71D67FFFEDA60000)
        y ^= (y << numpy.uint64(37)) & numpy.uint64(0xFFF7EEE000000000)
        return y ^ (y >> numpy.uint64(43))


class Random:
    """palpate::Random: uniform and normal numbers of a seed and a purpose."""

    def __init__(self, seed: int, stream: Stream) -> None:
        words = seed_sequence([seed & 0xFFFFFFFF, seed >> 32, int(stream)], 2 * _SIZE)
        low_first = numpy.array(words, numpy.uint64).reshape(_SIZE, 2)
        self._engine = MersenneTwister(low_first[:, 0] | low_first[:, 1] << numpy.uint64(32))

    def uniforms(self, n: int) -> NDArray[numpy.float64]:
        """n numbers uniform over [0, 1), [n]."""
        return (self._engine.draw(n) >> numpy.uint64(11)).astype(numpy.float64) * 2.0**-53

    def normals(self, n: int) -> NDArray[numpy.float64]:
        """n standard normal numbers, each of two uniform ones (Box and Muller 1958), [n]."""
        u = self.uniforms(2 * n)
        return numpy.array(
            [
                math.sqrt(-2.0 * math.log(1.0 - a)) * math.cos(2.0 * math.pi * b)
                for a, b in u.reshape(n, 2).tolist()
            ]
        )

    def order(self, n: int) -> list[int]:
        """0 to n - 1 in a random order (Fisher and Yates)."""
        order = list(range(n))
        for i, u in enumerate(self.uniforms(max(n - 1, 0)).tolist()):
            j = i + int((n - i) * u)
            order[i], order[j] = order[j], order[i]
        return order
