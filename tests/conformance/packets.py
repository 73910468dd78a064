# SPDX-License-Identifier: MIT
"""Level directories and .pmcd files as docs/FORMAT.md has them: read, checked, and made up for tests.

A made mesh has right headers, lengths and checksums and random payloads: enough for whoever moves packets, useless to
a decoder. Nothing here decodes a packet.
"""

import dataclasses
import hashlib
import pathlib
import random
import struct

_HEAD = 100
_LEVEL = struct.Struct("<IIIIdd")
_PACKET_HEAD = 48


class BadFile(Exception):
    """Bytes that are no directory or packet of FORMAT.md; the text says why."""


def _crc_table():
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
        table.append(byte)
    return table


_TABLE = _crc_table()


def crc32c(data, before=0):
    """CRC32C (Castagnoli) of `data`; `before` is the checksum of what stands ahead of it."""
    crc = before ^ 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


def _times(matrix, vector):
    out = 0
    for column in matrix:
        if vector & 1:
            out ^= column
        vector >>= 1
    return out


def _zeros(count):
    """The linear map on the checksum's register that `count` zero bytes are, as 32 columns."""
    power = [_TABLE[1 << bit] if bit < 8 else 1 << (bit - 8) for bit in range(32)]
    result = [1 << bit for bit in range(32)]
    while count:
        if count & 1:
            result = [_times(power, column) for column in result]
        power = [_times(power, column) for column in power]
        count >>= 1
    return result


def crc32c_joined(first, second, second_length):
    """The checksum of two pieces, one behind the other, from the checksum of each."""
    return _times(_zeros(second_length), first) ^ second


def sha256(data):
    return hashlib.sha256(data).hexdigest()


@dataclasses.dataclass
class Level:
    bytes: int
    vertices: int
    faces: int
    crc: int
    rms: float
    most: float


@dataclasses.dataclass
class Directory:
    """A level directory, decoded; `raw` is its bytes."""
    raw: bytes
    flags: int
    bits: int
    generation: int
    box: tuple
    levels: list

    @property
    def all_bytes(self):
        return sum(level.bytes for level in self.levels)


def read_directory(data):
    """The directory at the beginning of `data`, checked against its own checksum."""
    if len(data) < _HEAD or data[:4] != b"PMCD" or data[4] != 0 or data[7] != 0:
        raise BadFile(f"no level directory: {data[:16].hex(' ')}")
    count = struct.unpack_from("<I", data, 8)[0]
    size = _HEAD + _LEVEL.size * count + 4
    if count < 1 or len(data) < size:
        raise BadFile(f"a directory of {count} levels in {len(data)} bytes")
    if crc32c(data[:size - 4]) != struct.unpack_from("<I", data, size - 4)[0]:
        raise BadFile("the directory's checksum is wrong")
    levels = [Level(*_LEVEL.unpack_from(data, _HEAD + _LEVEL.size * k)) for k in range(count)]
    return Directory(data[:size], data[5], data[6], struct.unpack_from("<Q", data, 12)[0],
                     struct.unpack_from("<6d", data, 52), levels)


def check_packet(data, level, number):
    """Raises BadFile unless `data` is packet `number` as `level` announced it: length, head, checksum."""
    if len(data) != level.bytes:
        raise BadFile(f"packet {number} has {len(data)} bytes, the directory says {level.bytes}")
    if data[:4] != b"PMCP" or struct.unpack_from("<I", data, 8)[0] != number:
        raise BadFile(f"no packet {number}: {data[:12].hex(' ')}")
    announced = struct.unpack_from("<I", data, 44)[0]
    computed = crc32c(data[48:], crc32c(data[:44]))
    if not announced == computed == level.crc:
        raise BadFile(f"packet {number}: checksum {computed:08x}, in the packet {announced:08x}, in the directory "
                      f"{level.crc:08x}")


class PacketFile:
    """A .pmcd file: its directory and its packets."""

    def __init__(self, data):
        self.directory = read_directory(data)
        self.packets, at = [], len(self.directory.raw)
        for level in self.directory.levels:
            self.packets.append(data[at:at + level.bytes])
            at += level.bytes
        if at != len(data):
            raise BadFile(f"{len(data)} bytes, the directory says {at}")

    @classmethod
    def load(cls, path):
        return cls(pathlib.Path(path).read_bytes())

    @property
    def data(self):
        return self.directory.raw + b"".join(self.packets)

    @property
    def generation(self):
        return self.directory.generation


# Long payloads repeat a block of this prime length, so that their checksum is quickly made and no cut hides.
_BLOCK = 65521


def _payload(source, size):
    """(random bytes, their checksum)."""
    block = source.randbytes(min(size, _BLOCK))
    crc, rest = crc32c(block), size % _BLOCK if size > _BLOCK else 0
    total, shift = crc, _zeros(_BLOCK)
    for _ in range(size // _BLOCK - 1):
        total = _times(shift, total) ^ crc
    if rest:
        total = crc32c_joined(total, crc32c(block[:rest]), rest)
    return (block * (size // _BLOCK + 1))[:size], total


def make(sizes, seed):
    """A PacketFile whose packets have these lengths (49 bytes at least) and random payloads; the same for the same seed."""
    source = random.Random(seed)
    generation = source.getrandbits(64)
    packets, levels = [], []
    for k, size in enumerate(sizes):
        vertices, faces = 4 << k, 4 << k
        payload, payload_crc = _payload(source, size - _PACKET_HEAD)
        head = b"PMCP" + struct.pack("<BBBBIIIIQQI", 0, 0 if k == 0 else 1, 1 if k == len(sizes) - 1 else 0, 0, k,
                                     len(payload), vertices, faces, source.getrandbits(64), generation, 0)
        crc = crc32c_joined(crc32c(head), payload_crc, len(payload))
        packets.append(head + struct.pack("<I", crc) + payload)
        levels.append(_LEVEL.pack(len(packets[-1]), vertices, faces, crc, -1.0, -1.0))
    raw = (b"PMCD" + struct.pack("<BBBBIQ", 0, 0, 10, 0, len(sizes), generation)
           + struct.pack("<10d", 0, 0, 0, 0.001, 0, 0, 0, 1, 1, 1) + b"".join(levels))
    raw += struct.pack("<I", crc32c(raw))
    return PacketFile(raw + b"".join(packets))
