# SPDX-License-Identifier: MIT
"""Files, packet headers, base headers and the level hash, written from docs/FORMAT.md alone."""
import struct
from stream import MASK64, Damaged


class Bytes:
    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, count):
        if self.at + count > len(self.data):
            raise Damaged("the bytes end too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def unsigned(self, count):
        return int.from_bytes(self.take(count), "little")

    def varint(self):
        value = shift = 0
        while True:
            byte = self.unsigned(1)
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                if byte == 0 and shift > 7:
                    raise Damaged("a varint longer than it needs to be")
                return value

    def zigzag(self):
        value = self.varint()
        return -(value + 1) // 2 if value & 1 else value // 2

    def f32(self):
        return struct.unpack("<f", self.take(4))[0]

    def f64(self):
        return struct.unpack("<d", self.take(8))[0]


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def multiple_of(multiple, exponent, k):
    """k of the unit, in double."""
    if multiple == 0:
        return k * 2.0 ** exponent
    if exponent < 0:
        return float(k * multiple) / float(10 ** -exponent)
    return float(k * multiple) * float(10 ** exponent)


class BaseHeader:
    def __init__(self, reader):
        self.bits = reader.unsigned(1)
        flags = reader.unsigned(1)
        if flags & 0x80 or not 4 <= self.bits <= 24:
            raise Damaged("base header")
        self.lossless = flags & 1
        self.double = flags >> 1 & 1
        self.exact = flags >> 6 & 1
        self.most = (1 << self.bits) - 1
        self.unit = None
        if flags >> 5 & 1:
            multiple = reader.unsigned(1)
            exponent = reader.zigzag()
            self.whole = [reader.zigzag() for _ in range(3)]
            self.unit = (multiple, exponent)
            self.origin = [multiple_of(multiple, exponent, k) for k in self.whole]
            self.step = multiple_of(multiple, exponent, 1)
            return
        self.origin = [reader.f64() if flags >> 2 & 1 else reader.f32() for _ in range(3)]
        axis = flags >> 3 & 3
        if axis == 0:
            self.step = reader.f64()
        else:
            self.step = (reader.f32() - self.origin[axis - 1]) / self.most


class Packet:
    """Header and payload; checks the checksum."""

    def __init__(self, data):
        reader = Bytes(data)
        if reader.unsigned(1) != 0x9B:
            raise Damaged("no packet")
        flags = reader.unsigned(1)
        if flags & 0xF0:
            raise Damaged("version")
        self.last = flags & 1
        self.shift = flags >> 1 & 7
        checksum = reader.unsigned(4)
        if checksum != crc32c(data[:2] + data[6:]):
            raise Damaged("checksum")
        self.level = reader.varint()
        size = reader.varint()
        self.vertices = reader.varint()
        self.faces = 2 * self.vertices + reader.zigzag()
        if self.shift == 7:
            self.shift = reader.unsigned(1)
        self.hash_bytes = 8 if self.last else 3
        self.hash = reader.unsigned(self.hash_bytes)
        self.generation = reader.unsigned(8 if self.level == 0 else 2)
        self.payload = reader.take(size)
        if reader.at != len(data):
            raise Damaged("bytes after the packet")


def split_file(data):
    """The packets of a file, by its directory."""
    if data[:5] != b"PMCD\0":
        raise Damaged("no file")
    reader = Bytes(data)
    reader.take(5)
    size = reader.varint()
    end = reader.at + size
    if int.from_bytes(data[end - 4:end], "little") != crc32c(data[:end - 4]):
        raise Damaged("the directory's checksum")
    parts = reader.unsigned(1)
    BaseHeader(reader)
    reader.take(8)
    for bit in range(6):
        if parts >> bit & 1:
            reader.take(8 if parts & 0x40 else 4)
    packets = []
    at = end
    vertices = 0
    while reader.at < end - 4:
        length = reader.varint()
        vertices += reader.zigzag()
        faces = 2 * vertices + reader.zigzag()
        checksum = reader.unsigned(4)
        if parts & 0x80:
            reader.take(4)
        packet = data[at:at + length]
        at += length
        parsed = Packet(packet)
        if (parsed.level, parsed.vertices, parsed.faces) != (len(packets), vertices, faces):
            raise Damaged("directory and packet disagree")
        if checksum != int.from_bytes(packet[2:6], "little"):
            raise Damaged("checksums of directory and packet disagree")
        packets.append(parsed)
    if at != len(data) or reader.at != end - 4:
        raise Damaged("bytes left over")
    return packets


def _mix(x):
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & MASK64
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & MASK64
    return x ^ (x >> 31)


class Hash:
    INCREMENT = 0x9E3779B97F4A7C15

    def __init__(self):
        self.state = 0
        self.count = 0

    def add(self, word):
        self.count += 1
        x = self.state ^ _mix((word + self.INCREMENT * self.count) & MASK64)
        x = ((x << 27) | (x >> 37)) & MASK64
        self.state = (x * 0xD6E8FEB86659FD93 + self.INCREMENT) & MASK64

    def add_real(self, value):
        self.add(struct.unpack("<Q", struct.pack("<d", value))[0])

    def value(self):
        return _mix(self.state ^ self.count)


def level_hash(base, points, faces, exact):
    h = Hash()
    h.add(base.bits * 4 + 2 * base.double + base.lossless)
    for value in base.origin:
        h.add_real(value)
    h.add_real(base.step)
    if base.unit:
        h.add((base.unit[0] << 32) + (base.unit[1] & 0xFFFF) * 2 + base.exact)
        for k in base.whole:
            h.add(k & MASK64)
    h.add(len(points))
    h.add(len(faces))
    for x, y, z in points:
        h.add((x << 32) + y)
        h.add(z)
    for a, b, c in faces:
        h.add((a << 32) + b)
        h.add(c)
    for position in exact:
        for value in position:
            h.add_real(value)
    return h.value()
