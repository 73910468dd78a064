# SPDX-License-Identifier: MIT
"""The frames and messages of docs/PROTOCOL.md: types, codes and limits, and bodies to and from fields.

Written from the document alone; it opens no socket and shares no code with pmcd. Wrong bodies are made with frame().
"""

import dataclasses
import struct
import unicodedata

MAGIC, ADMIN_MAGIC = b"PMCD", b"PMCA"
MAJOR, MINOR = 1, 0

MAX_TO_SERVER = 4096
MAX_TO_CLIENT = 524288
MAX_ADMIN = 1048576
MAX_CHUNK = 262144
MAX_DIRECTORY = 262144
MAX_PAGE = 1000
MAX_NAME = 128
MAX_AGENT = 64
MAX_TEXT = 512

COMPLETE, CANCELLED, FAILED, END_OF_MESH = range(4)
RESULTS = ("complete", "cancelled", "failed", "end_of_mesh")
DRAINING, MESH_RETIRED = 1, 2

# name: (type, fields). A field is (name, kind); kinds are those of the document, `N` stands for N bytes as they are.
# `options` are as many pairs of str8, name and value, as the field before them says.
MESSAGES = {
    "hello": (0x0001, "magic:4 major:u16 minor:u16 agent:str8"),
    "hello_ok": (0x0002, "magic:4 major:u16 minor:u16 token:16 data_port:u16 seconds:u16 open_requests:u8 agent:str8"),
    "error": (0x0003, "id:u32 code:u16 text:str16"),
    "ping": (0x0004, "id:u32"),
    "pong": (0x0005, "id:u32"),
    "goodbye": (0x0006, ""),
    "join": (0x0007, "magic:4 major:u16 minor:u16 token:16"),
    "join_ok": (0x0008, "magic:4 major:u16 minor:u16"),
    "notice": (0x0009, "kind:u16 handle:u32 seconds:u32 text:str16"),
    "get_mesh_list": (0x0010, "id:u32 filter:str8 after:str8 most:u16"),
    "get_base_mesh": (0x0011, "id:u32 name:str8"),
    "get_next_packet": (0x0012, "id:u32 handle:u32"),
    "get_packet": (0x0013, "id:u32 generation:u64 packet:u32 offset:u64"),
    "cancel": (0x0014, "id:u32"),
    "mesh_opened": (0x0020, "id:u32 handle:u32 generation:u64 directory:rest"),
    "chunk": (0x0030, "id:u32 handle:u32 packet:u32 offset:u64 total:u64 bytes:rest"),
    "transfer_end": (0x0031, "id:u32 result:u8 code:u16"),
    "admin_hello": (0x0101, "magic:4 major:u16 minor:u16 agent:str8"),
    "admin_hello_ok": (0x0102, "magic:4 major:u16 minor:u16 agent:str8"),
    "admin_list": (0x0110, "id:u32"),
    "admin_show": (0x0111, "id:u32 name:str8"),
    "admin_remove": (0x0112, "id:u32 name:str8"),
    "admin_status": (0x0113, "id:u32"),
    "ingest_begin": (0x0120, "id:u32 flags:u8 name:str8 directory:rest"),
    "ingest_ready": (0x0121, "id:u32"),
    "ingest_data": (0x0122, "id:u32 packet:u32 offset:u64 bytes:rest"),
    "ingest_commit": (0x0123, "id:u32"),
    "ingest_ok": (0x0124, "id:u32 generation:u64 replaced:u8"),
    "admin_answer": (0x0130, "id:u32 last:u8 text:rest"),
    "admin_rules": (0x0140, "id:u32"),
    "admin_rule": (0x0141, "id:u32"),
    "admin_set_rule": (0x0142, "id:u32 flags:u8 version:u64 rule:str8 count:u8 options:options"),
    "admin_history": (0x0143, "id:u32 most:u32"),
    "admin_revert": (0x0144, "id:u32 flags:u8 version:u64 change:u64"),
    "admin_queue": (0x0145, "id:u32"),
    "admin_clients": (0x0146, "id:u32"),
    "admin_explain": (0x0147, "id:u32 session:u64"),
    "admin_weight": (0x0148, "id:u32 session:u64 weight:u32"),
}
MESSAGES = {name: (number, [tuple(field.split(":")) for field in fields.split()])
            for name, (number, fields) in MESSAGES.items()}
NAMES = {number: name for name, (number, _) in MESSAGES.items()}
TYPES = {name: number for name, (number, _) in MESSAGES.items()}
GROWING = ("hello", "hello_ok", "join", "join_ok", "admin_hello", "admin_hello_ok")
REQUESTS = ("get_mesh_list", "get_base_mesh", "get_next_packet", "get_packet")

CODES = {
    "unsupported_version": 1, "bad_magic": 2, "frame_too_long": 3, "malformed": 4, "wrong_state": 5, "bad_token": 6,
    "hello_timeout": 7, "join_timeout": 8, "duplicate_id": 9, "too_many_sessions": 10, "shutting_down": 11,
    "stalled": 12, "channel_lost": 13, "unknown_type": 32, "not_joined": 33, "too_many_requests": 34,
    "unknown_mesh": 35, "unknown_handle": 36, "bad_name": 37, "internal_error": 38, "bad_range": 39,
    "unavailable": 64, "mesh_changed": 65, "mesh_exists": 128, "bad_directory": 129, "bad_packet": 130,
    "ingest_incomplete": 131, "too_large": 132, "storage_failed": 133,
    "bad_rule": 134, "bad_option": 135, "version_changed": 136, "unknown_client": 137, "unknown_change": 138,
}
CODE_NAMES = {number: name for name, number in CODES.items()}

_NUMBERS = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q"}
_HIDDEN = ({*range(0x20), *range(0x7F, 0xA0), 0x61C, 0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2066, 0x206A),
            0xFEFF})


class WrongForm(Exception):
    """A body that is not what its type says."""


@dataclasses.dataclass
class Message:
    """A frame as it came: name is None for an unknown type; `extra` is what a later version put at the end."""
    type: int
    body: bytes
    name: str | None = None
    fields: dict = dataclasses.field(default_factory=dict)
    extra: bytes = b""

    def __getattr__(self, name):
        try:
            return self.__dict__["fields"][name]
        except KeyError:
            raise AttributeError(name) from None

    def __str__(self):
        if self.name is None:
            return f"frame of type {self.type:#06x}, body {hex_of(self.body)}"
        parts = [f"{key} {_shown(key, value)}" for key, value in self.fields.items() if key != "magic"]
        return f"{self.name}({', '.join(parts)})"


def _shown(key, value):
    if key == "code" and value:
        return f"{value} {CODE_NAMES.get(value, '?')}"
    if key == "result":
        return RESULTS[value] if value < len(RESULTS) else value
    return hex_of(value) if isinstance(value, bytes) else repr(value)


def hex_of(data, most=48):
    """Bytes for a reader: hex in pairs, cut behind `most` bytes."""
    return data[:most].hex(" ") + (f" ... ({len(data)} bytes)" if len(data) > most else "") if data else "(none)"


def printable(text):
    return not any(ord(c) in _HIDDEN or ord(c) & 0xFFFE == 0xFFFE or unicodedata.category(c) == "Cs" for c in text)


def is_mesh_name(name):
    return (1 <= len(name.encode()) <= MAX_NAME and printable(name) and "/" not in name and name not in (".", "..")
            and name.strip(" ") == name)


def frame(number, body=b""):
    """A frame with these bytes as body, right or wrong."""
    return struct.pack("<IH", len(body) + 2, number) + body


def _str8(text):
    data = text.encode() if isinstance(text, str) else bytes(text)
    return struct.pack("<B", len(data)) + data


def body_of(name, /, **fields):
    """The body of message `name`. Every field has to be given but magic, major and minor."""
    defaults = {"magic": ADMIN_MAGIC if name.startswith("admin") else MAGIC, "major": MAJOR, "minor": MINOR}
    out = b""
    for field, kind in MESSAGES[name][1]:
        value = fields.pop(field) if field in fields else defaults[field]
        if kind in _NUMBERS:
            out += struct.pack(_NUMBERS[kind], value)
            continue
        if kind == "options":
            out += b"".join(_str8(text) for option in value for text in option)
            continue
        data = value.encode() if isinstance(value, str) else bytes(value)
        if kind == "str8":
            out += _str8(data)
        elif kind == "str16":
            out += struct.pack("<H", len(data)) + data
        else:
            out += data
    if fields:
        raise TypeError(f"{name} has no {', '.join(fields)}")
    return out


def message(name, /, **fields):
    """The whole frame of message `name`."""
    return frame(TYPES[name], body_of(name, **fields))


def parse(number, body, minor=MINOR):
    """The Message in a frame; raises WrongForm unless the body is read exactly (F-3, V-1)."""
    name = NAMES.get(number)
    result = Message(number, body, name)
    if name is None:
        return result
    at = 0

    def take(count, what):
        nonlocal at
        if at + count > len(body):
            raise WrongForm(f"{name} is too short for {what}: body {hex_of(body)}")
        at += count
        return body[at - count:at]

    for field, kind in MESSAGES[name][1]:
        if kind in _NUMBERS:
            value = struct.unpack(_NUMBERS[kind], take(struct.calcsize(_NUMBERS[kind]), field))[0]
        elif kind == "options":
            value = [tuple(take(take(1, field)[0], field).decode() for _ in range(2)) for _ in range(result.count)]
        elif kind in ("str8", "str16"):
            raw = take(struct.unpack("<B" if kind == "str8" else "<H", take(1 if kind == "str8" else 2, field))[0], field)
            if field in ("filter", "after"):  # what bytes they are is not judged
                result.fields[field] = raw.decode("utf-8", "surrogateescape")
                continue
            try:
                value = raw.decode("utf-8")
            except UnicodeDecodeError as wrong:
                raise WrongForm(f"{name}: {field} is not UTF-8: {hex_of(raw)}") from wrong
            if not printable(value):
                raise WrongForm(f"{name}: {field} is not printable: {hex_of(raw)}")
        else:
            value = take(len(body) - at if kind == "rest" else int(kind), field)
        result.fields[field] = value
    if at < len(body) and not (name in GROWING and result.minor > minor):
        raise WrongForm(f"{name} has {len(body) - at} bytes too many: body {hex_of(body)}")
    result.extra = body[at:]
    return result
