# SPDX-License-Identifier: MIT
"""Level directories and .pmcd files as docs/FORMAT.md has them: read, checked, and made up for tests.

A made mesh has right headers, lengths and checksums and random payloads: enough for whoever moves packets, useless to
a decoder. Nothing here decodes a packet.
"""

import dataclasses
import hashlib
import math
import pathlib
import random
import struct

_MAGIC = 0x9B
_NUMBERS = 6  # of a packet's header: level, payload bytes, vertices, faces
_LOSSLESS, _FLOAT64, _WIDE_ORIGIN, _UPPER_AXIS, _MULTIPLES = 1, 2, 4, 0x18, 0x20
_WIDE_BOX, _MEASURED = 0x40, 0x80
_NOT_MEASURED = 0xFFFF
_MOST_VARINT, _MOST_ORIGIN = 5, 8  # bytes


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


def varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out) + bytes([value])


def zigzag(value):
    return 2 * value if value >= 0 else -2 * value - 1


class _Reader:
    """Fields one after the other; BadFile where they end too early or a varint is not the shortest."""

    def __init__(self, data, at, end):
        self.data, self.at, self.end = data, at, end

    def take(self, form):
        size = struct.calcsize(form)
        if self.at + size > self.end:
            raise BadFile(f"ends at {self.end}, {size} bytes are wanted at {self.at}")
        self.at += size
        return struct.unpack_from(form, self.data, self.at - size)

    def varint(self, most_bytes=_MOST_VARINT):
        value = 0
        for place in range(most_bytes):
            byte, = self.take("<B")
            value |= (byte & 0x7F) << 7 * place
            if byte < 0x80:
                if byte == 0 and place:
                    break
                return value
        raise BadFile(f"a varint with too many bytes before {self.at}")

    def signed(self, most_bytes=_MOST_VARINT):
        value = self.varint(most_bytes)
        return value >> 1 if value % 2 == 0 else -(value + 1 >> 1)


@dataclasses.dataclass
class Level:
    bytes: int
    vertices: int
    faces: int
    bits: int
    crc: int
    rms: float
    most: float


@dataclasses.dataclass
class Directory:
    """A level directory, decoded; `raw` is its bytes, `flags` says lossless (1) and float64 (2)."""
    raw: bytes
    flags: int
    bits: int
    generation: int
    box: tuple
    levels: list

    @property
    def all_bytes(self):
        return sum(level.bytes for level in self.levels)


def _float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def _multiple(unit, whole):
    """So many units as a float, rounded once; unit: multiple (0: powers of two), exponent."""
    multiple, exponent = unit
    if multiple == 0:
        return math.ldexp(whole, exponent)
    if exponent < 0:
        return whole * multiple / 10**-exponent
    return float(whole * multiple * 10**exponent)


def _read_corners(reader, bits, flags):
    """The coordinates of the first and the last point of a lattice, not rounded to float32."""
    most = 2**bits - 1
    if flags & _MULTIPLES:
        unit = (reader.take("<B")[0], reader.signed())
        origin = [reader.signed(_MOST_ORIGIN) for _ in range(3)]
        return [_multiple(unit, whole) for whole in origin], [_multiple(unit, whole + most) for whole in origin]
    origin = reader.take("<3d" if flags & _WIDE_ORIGIN else "<3f")
    axis = (flags & _UPPER_AXIS) >> 3
    if axis:
        step = (reader.take("<f")[0] - origin[axis - 1]) / most
    else:
        step, = reader.take("<d")
    return origin, [low + most * step for low in origin]


def _read_lattice(reader):
    """(bits, flags, the box that the lattice spans)."""
    bits, flags = reader.take("<BB")
    if not 4 <= bits <= 24 or flags >= 0x80:
        raise BadFile(f"a base header of {bits} bits, flags {flags:02x}")
    low, high = _read_corners(reader, bits, flags)
    return bits, flags & (_LOSSLESS | _FLOAT64), [x if flags & _FLOAT64 else _float32(x) for x in [*low, *high]]


def _error(code):
    if code in (0, _NOT_MEASURED):
        return -1.0 if code else 0.0
    return (1 + code % 1024 / 1024) * 2.0 ** (code // 1024 - 50)


def _read_levels(reader, measured):
    vertices = bits = 0
    while reader.at < reader.end:
        size, vertices = reader.varint(), vertices + reader.signed()
        faces, (more_bits, crc) = 2 * vertices + reader.signed(), reader.take("<BI")
        bits += more_bits
        errors = map(_error, reader.take("<HH") if measured else (_NOT_MEASURED, _NOT_MEASURED))
        yield Level(size, vertices, faces, bits, crc, *errors)


def read_directory(data):
    """The directory at the beginning of `data`, checked against its own checksum."""
    if data[:4] != b"PMCD" or data[4:5] != b"\0":
        raise BadFile(f"no level directory: {data[:16].hex(' ')}")
    reader = _Reader(data, 5, len(data))
    rest = reader.varint()
    size = reader.at + rest
    if rest < 4 or len(data) < size:
        raise BadFile(f"a directory of {size} bytes in {len(data)} bytes")
    if crc32c(data[:size - 4]) != struct.unpack_from("<I", data, size - 4)[0]:
        raise BadFile("the directory's checksum is wrong")
    reader.end = size - 4
    parts, = reader.take("<B")
    bits, flags, box = _read_lattice(reader)
    generation, = reader.take("<Q")
    for place in range(6):
        if parts >> place & 1:
            box[place], = reader.take("<d" if parts & _WIDE_BOX else "<f")
    levels = list(_read_levels(reader, parts & _MEASURED))
    if not levels:
        raise BadFile("a directory without a level")
    if levels[0].bits < 1 or levels[-1].bits != bits:
        raise BadFile(f"levels of {levels[0].bits} to {levels[-1].bits} bits on a lattice of {bits}")
    return Directory(data[:size], flags, bits, generation, tuple(box), levels)


def write_directory(flags, bits, generation, levels):
    """A directory over the unit cube whose levels have no errors."""
    content = (struct.pack("<BBB3ffQ", 0, bits, flags | 1 << 3, 0, 0, 0, 1, generation)
               + b"".join(varint(level.bytes) + varint(zigzag(level.vertices - before.vertices))
                          + varint(zigzag(level.faces - 2 * level.vertices))
                          + struct.pack("<BI", level.bits - before.bits, level.crc)
                          for before, level in zip([Level(0, 0, 0, 0, 0, -1.0, -1.0), *levels], levels)))
    raw = b"PMCD\0" + varint(len(content) + 4) + content
    return raw + struct.pack("<I", crc32c(raw))


def packet_head(number, last, payload, vertices, faces, mesh_hash, generation):
    """(two bytes, the rest of the header): what stands before the checksum and behind it. No digits are missing."""
    return (bytes([_MAGIC, int(last)]),
            varint(number) + varint(payload) + varint(vertices) + varint(zigzag(faces - 2 * vertices))
            + struct.pack("<Q", mesh_hash)[:8 if last else 3] + struct.pack("<Q", generation)[:8 if number == 0 else 2])


def check_packet(data, level, number):
    """Raises BadFile unless `data` is packet `number` as `level` announced it: length, head, checksum."""
    if len(data) != level.bytes:
        raise BadFile(f"packet {number} has {len(data)} bytes, the directory says {level.bytes}")
    flags = data[1]  # the last level lacks no digits
    if (data[0] != _MAGIC or flags >> 4 or (flags & 1 and flags != 1)
            or _Reader(data, _NUMBERS, len(data)).varint() != number):
        raise BadFile(f"no packet {number}: {data[:12].hex(' ')}")
    announced, = struct.unpack_from("<I", data, 2)
    computed = crc32c(data[_NUMBERS:], crc32c(data[:2]))
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
    """A PacketFile whose packets have these lengths (27 bytes at least; a few are one byte shorter) and random payloads;
    the same for the same seed."""
    source = random.Random(seed)
    generation = source.getrandbits(64)
    packets, levels = [], []
    for k, size in enumerate(sizes):
        vertices, faces, mesh_hash = 4 << k, 4 << k, source.getrandbits(64)
        def head(payload_bytes):
            return packet_head(k, k == len(sizes) - 1, payload_bytes, vertices, faces, mesh_hash, generation)

        # The number of payload bytes is part of the header; where it grows by a byte, a size is left out.
        payload_bytes = next(n for n in range(size, -1, -1) if n + 4 + sum(map(len, head(n))) <= size)
        start, rest = head(payload_bytes)
        payload, payload_crc = _payload(source, payload_bytes)
        crc = crc32c_joined(crc32c(rest, crc32c(start)), payload_crc, len(payload))
        packets.append(start + struct.pack("<I", crc) + rest + payload)
        levels.append(Level(len(packets[-1]), vertices, faces, 10, crc, -1.0, -1.0))
    raw = write_directory(0, 10, generation, levels)
    return PacketFile(raw + b"".join(packets))
