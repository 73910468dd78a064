# SPDX-License-Identifier: GPL-3.0-or-later
"""Files in pmcd's form whose packets have right headers and checksums, but nothing but zeros behind them.

They can be of any size at no cost, and the daemon, which looks no further, stores them; nobody can decode them.
docs/FORMAT.md has the form.
"""

import struct

_HEADER_BYTES = 48
_POLYNOMIAL = 0x82F63B78
_ALL = 0xFFFFFFFF


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


def _header(level, last, payload_bytes, generation):
    """A packet's header and its checksum, which is in it."""
    body = b"PMCP" + struct.pack("<BBBBIIIIQQI", 0, 0 if level == 0 else 1, int(last), 0, level, payload_bytes,
                                 10 * (level + 1), 20 * (level + 1), 7, generation, 0)
    checksum = _feed_zeros(_feed(_ALL, body), payload_bytes) ^ _ALL
    return body + struct.pack("<I", checksum), checksum


def write(path, payloads, generation=1):
    """A .pmcd file with one packet for each of `payloads`, which are numbers of bytes."""
    directory = b"PMCD" + struct.pack("<BBBBIQ", 0, 0, 14, 0, len(payloads), generation)
    directory += struct.pack("<10d", 0, 0, 0, 1, 0, 0, 0, 1, 1, 1)
    headers = []
    for level, payload_bytes in enumerate(payloads):
        header, checksum = _header(level, level + 1 == len(payloads), payload_bytes, generation)
        headers.append(header)
        directory += struct.pack("<4I2d", _HEADER_BYTES + payload_bytes, 10 * (level + 1), 20 * (level + 1), checksum,
                                 -1, -1)
    directory += struct.pack("<I", _feed(_ALL, directory) ^ _ALL)
    with open(path, "wb") as file:
        file.write(directory)
        for header, payload_bytes in zip(headers, payloads):
            file.write(header)
            file.seek(payload_bytes, 1)
        file.truncate()
    return path
