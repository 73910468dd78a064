# SPDX-License-Identifier: GPL-3.0-or-later
"""Files in pmcd's form whose packets have right headers and checksums, but nothing but zeros behind them.

They can be of any size at no cost, and the daemon, which looks no further, stores them; nobody can decode them.
docs/FORMAT.md has the form.
"""

import struct

_POLYNOMIAL = 0x82F63B78
_ALL = 0xFFFFFFFF
_BITS = 14  # of the lattice


def _step(register):
    """The CRC register after one more zero bit."""
    return (register >> 1) ^ (_POLYNOMIAL if register & 1 else 0)


def _feed(register, data):
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = _step(register)
    return register


def _apply(matrix, vector):
    """`matrix` is what each single bit of a register becomes."""
    result = 0
    for bit in range(32):
        if vector >> bit & 1:
            result ^= matrix[bit]
    return result


def _feed_zeros(register, count):
    """The register after `count` zero bytes, by squaring the matrix of one byte."""
    matrix = [_feed(1 << bit, b"\0") for bit in range(32)]
    while count:
        if count & 1:
            register = _apply(matrix, register)
        matrix = [_apply(matrix, column) for column in matrix]
        count >>= 1
    return register


def _varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _header(level, last, payload_bytes, generation):
    """A packet's header and its checksum, which is in it. The packet has 10 vertices a level and twice as many faces."""
    start = bytes([0x9B, int(last)])
    rest = _varint(level) + _varint(payload_bytes) + _varint(10 * (level + 1)) + b"\0"
    rest += struct.pack("<Q", 7)[:8 if last else 3] + struct.pack("<Q", generation)[:8 if level == 0 else 2]
    checksum = _feed_zeros(_feed(_ALL, start + rest), payload_bytes) ^ _ALL
    return start + struct.pack("<I", checksum) + rest, checksum


def write(path, payloads, generation=1):
    """A .pmcd file with one packet for each of `payloads`, which are numbers of bytes."""
    # The box is the lattice's, from 0 to 1; nothing was measured.
    content = struct.pack("<BBB3ffQ", 0, _BITS, 1 << 3, 0, 0, 0, 1, generation)
    headers = []
    for level, payload_bytes in enumerate(payloads):
        header, checksum = _header(level, level + 1 == len(payloads), payload_bytes, generation)
        headers.append(header)
        bits = bytes([_BITS if level == 0 else 0])  # of positions; no level lacks any
        content += _varint(len(header) + payload_bytes) + _varint(20) + b"\0" + bits + struct.pack("<I", checksum)
    directory = b"PMCD\0" + _varint(len(content) + 4) + content
    directory += struct.pack("<I", _feed(_ALL, directory) ^ _ALL)
    with open(path, "wb") as file:
        file.write(directory)
        for header, payload_bytes in zip(headers, payloads):
            file.write(header)
            file.seek(payload_bytes, 1)
        file.truncate()
    return path
