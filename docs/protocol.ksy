meta:
  id: pmcd
  title: The pmcd protocol, version 1.0
  license: MIT
  ks-version: "0.9"
  endian: le
doc: |
  The frames of the pmcd protocol and the bodies of all messages, as docs/PROTOCOL.md has them; what they mean stands
  there. A stream is one direction of one channel: a sequence of frames, nothing else. The body of a frame of unknown type
  is left as bytes. The level directory and the packets (docs/FORMAT.md) are bytes here.
doc-ref: docs/PROTOCOL.md
seq:
  - id: frames
    type: frame
    repeat: eos
enums:
  message_type:
    0x0001: hello
    0x0002: hello_ok
    0x0003: error
    0x0004: ping
    0x0005: pong
    0x0006: goodbye
    0x0007: join
    0x0008: join_ok
    0x0009: notice
    0x0010: get_mesh_list
    0x0011: get_base_mesh
    0x0012: get_next_packet
    0x0013: get_packet
    0x0014: cancel
    0x0020: mesh_opened
    0x0030: chunk
    0x0031: transfer_end
    0x0101: admin_hello
    0x0102: admin_hello_ok
    0x0110: admin_list
    0x0111: admin_show
    0x0112: admin_remove
    0x0113: admin_status
    0x0120: ingest_begin
    0x0121: ingest_ready
    0x0122: ingest_data
    0x0123: ingest_commit
    0x0124: ingest_ok
    0x0130: admin_answer
    0x0140: admin_rules
    0x0141: admin_rule
    0x0142: admin_set_rule
    0x0143: admin_history
    0x0144: admin_revert
    0x0145: admin_queue
    0x0146: admin_clients
    0x0147: admin_explain
    0x0148: admin_weight
  code:
    0: none
    1: unsupported_version
    2: bad_magic
    3: frame_too_long
    4: malformed
    5: wrong_state
    6: bad_token
    7: hello_timeout
    8: join_timeout
    9: duplicate_id
    10: too_many_sessions
    11: shutting_down
    12: stalled
    13: channel_lost
    32: unknown_type
    33: not_joined
    34: too_many_requests
    35: unknown_mesh
    36: unknown_handle
    37: bad_name
    38: internal_error
    39: bad_range
    64: unavailable
    65: mesh_changed
    128: mesh_exists
    129: bad_directory
    130: bad_packet
    131: ingest_incomplete
    132: too_large
    133: storage_failed
    134: bad_rule
    135: bad_option
    136: version_changed
    137: unknown_client
    138: unknown_change
  result:
    0: complete
    1: cancelled
    2: failed
    3: end_of_mesh
  notice_kind:
    1: draining
    2: mesh_retired
types:
  frame:
    seq:
      - id: length
        type: u4
        valid:
          min: 2
          max: 1048576
        doc: Bytes that follow, type and body. Each direction has a lower limit of its own.
      - id: type
        type: u2
        enum: message_type
      - id: body
        size: length - 2
        type:
          switch-on: type
          cases:
            message_type::hello: hello
            message_type::hello_ok: hello_ok
            message_type::error: error
            message_type::ping: ping
            message_type::pong: pong
            message_type::goodbye: goodbye
            message_type::join: join
            message_type::join_ok: join_ok
            message_type::notice: notice
            message_type::get_mesh_list: get_mesh_list
            message_type::get_base_mesh: get_base_mesh
            message_type::get_next_packet: get_next_packet
            message_type::get_packet: get_packet
            message_type::cancel: cancel
            message_type::mesh_opened: mesh_opened
            message_type::chunk: chunk
            message_type::transfer_end: transfer_end
            message_type::admin_hello: admin_hello
            message_type::admin_hello_ok: admin_hello_ok
            message_type::admin_list: admin_list
            message_type::admin_show: admin_show
            message_type::admin_remove: admin_remove
            message_type::admin_status: admin_status
            message_type::ingest_begin: ingest_begin
            message_type::ingest_ready: ingest_ready
            message_type::ingest_data: ingest_data
            message_type::ingest_commit: ingest_commit
            message_type::ingest_ok: ingest_ok
            message_type::admin_answer: admin_answer
            message_type::admin_rules: admin_rules
            message_type::admin_rule: admin_rule
            message_type::admin_set_rule: admin_set_rule
            message_type::admin_history: admin_history
            message_type::admin_revert: admin_revert
            message_type::admin_queue: admin_queue
            message_type::admin_clients: admin_clients
            message_type::admin_explain: admin_explain
            message_type::admin_weight: admin_weight

  # Pieces that several messages have.
  str8:
    seq:
      - id: length
        type: u1
      - id: text
        type: str
        encoding: UTF-8
        size: length
  str16:
    seq:
      - id: length
        type: u2
      - id: text
        type: str
        encoding: UTF-8
        size: length
  version:
    seq:
      - id: major
        type: u2
      - id: minor
        type: u2

  # Messages of a session.
  hello:
    seq:
      - id: magic
        contents: PMCD
      - id: version
        type: version
      - id: agent
        type: str8
      - id: later
        size-eos: true
        doc: Fields of a later minor version.
  hello_ok:
    seq:
      - id: magic
        contents: PMCD
      - id: version
        type: version
      - id: token
        size: 16
      - id: data_port
        type: u2
      - id: seconds
        type: u2
      - id: open_requests
        type: u1
      - id: agent
        type: str8
      - id: later
        size-eos: true
  error:
    seq:
      - id: id
        type: u4
      - id: code
        type: u2
        enum: code
      - id: text
        type: str16
  ping:
    seq:
      - id: id
        type: u4
  pong:
    seq:
      - id: id
        type: u4
  goodbye: {}
  join:
    seq:
      - id: magic
        contents: PMCD
      - id: version
        type: version
      - id: token
        size: 16
      - id: later
        size-eos: true
  join_ok:
    seq:
      - id: magic
        contents: PMCD
      - id: version
        type: version
      - id: later
        size-eos: true
  notice:
    seq:
      - id: kind
        type: u2
        enum: notice_kind
      - id: handle
        type: u4
      - id: seconds
        type: u4
      - id: text
        type: str16
  get_mesh_list:
    seq:
      - id: id
        type: u4
      - id: filter
        type: str8
      - id: after
        type: str8
      - id: most
        type: u2
  get_base_mesh:
    seq:
      - id: id
        type: u4
      - id: name
        type: str8
  get_next_packet:
    seq:
      - id: id
        type: u4
      - id: handle
        type: u4
  get_packet:
    seq:
      - id: id
        type: u4
      - id: generation
        type: u8
      - id: packet
        type: u4
      - id: offset
        type: u8
  cancel:
    seq:
      - id: id
        type: u4
  mesh_opened:
    seq:
      - id: id
        type: u4
      - id: handle
        type: u4
      - id: generation
        type: u8
      - id: directory
        size-eos: true
  chunk:
    seq:
      - id: id
        type: u4
      - id: handle
        type: u4
      - id: packet
        type: u4
      - id: offset
        type: u8
      - id: total
        type: u8
      - id: bytes
        size-eos: true
  transfer_end:
    seq:
      - id: id
        type: u4
      - id: result
        type: u1
        enum: result
      - id: code
        type: u2
        enum: code

  # What the chunks of a get_mesh_list bring, put together.
  mesh_list:
    seq:
      - id: matches
        type: u4
      - id: remaining
        type: u4
      - id: count
        type: u4
      - id: meshes
        type: mesh
        repeat: expr
        repeat-expr: count
  mesh:
    seq:
      - id: name
        type: str8
      - id: generation
        type: u8
      - id: vertices
        type: u4
      - id: faces
        type: u4
      - id: levels
        type: u4
      - id: bytes
        type: u8
      - id: flags
        type: u1
      - id: bits
        type: u1
      - id: format_version
        type: u1
      - id: box
        type: f8
        repeat: expr
        repeat-expr: 6
    instances:
      is_lossless:
        value: (flags & 1) != 0
      is_double:
        value: (flags & 2) != 0

  # Messages of the admin channel.
  admin_hello:
    seq:
      - id: magic
        contents: PMCA
      - id: version
        type: version
      - id: agent
        type: str8
      - id: later
        size-eos: true
  admin_hello_ok:
    seq:
      - id: magic
        contents: PMCA
      - id: version
        type: version
      - id: agent
        type: str8
      - id: later
        size-eos: true
  admin_list:
    seq:
      - id: id
        type: u4
  admin_show:
    seq:
      - id: id
        type: u4
      - id: name
        type: str8
  admin_remove:
    seq:
      - id: id
        type: u4
      - id: name
        type: str8
  admin_status:
    seq:
      - id: id
        type: u4
  ingest_begin:
    seq:
      - id: id
        type: u4
      - id: flags
        type: u1
      - id: name
        type: str8
      - id: directory
        size-eos: true
    instances:
      is_replacing:
        value: (flags & 1) != 0
  ingest_ready:
    seq:
      - id: id
        type: u4
  ingest_data:
    seq:
      - id: id
        type: u4
      - id: packet
        type: u4
      - id: offset
        type: u8
      - id: bytes
        size-eos: true
  ingest_commit:
    seq:
      - id: id
        type: u4
  ingest_ok:
    seq:
      - id: id
        type: u4
      - id: generation
        type: u8
      - id: replaced
        type: u1
  admin_answer:
    seq:
      - id: id
        type: u4
      - id: last
        type: u1
      - id: text
        size-eos: true
  admin_rules:
    seq:
      - id: id
        type: u4
  admin_rule:
    seq:
      - id: id
        type: u4
  admin_set_rule:
    seq:
      - id: id
        type: u4
      - id: flags
        type: u1
      - id: version
        type: u8
      - id: rule
        type: str8
      - id: count
        type: u1
      - id: options
        type: rule_option
        repeat: expr
        repeat-expr: count
    instances:
      is_dry_run:
        value: (flags & 1) != 0
      has_version:
        value: (flags & 2) != 0
  rule_option:
    seq:
      - id: name
        type: str8
      - id: value
        type: str8
  admin_history:
    seq:
      - id: id
        type: u4
      - id: most
        type: u4
  admin_revert:
    seq:
      - id: id
        type: u4
      - id: flags
        type: u1
      - id: version
        type: u8
      - id: change
        type: u8
        doc: 0 is the configuration.
    instances:
      is_dry_run:
        value: (flags & 1) != 0
      has_version:
        value: (flags & 2) != 0
  admin_queue:
    seq:
      - id: id
        type: u4
  admin_clients:
    seq:
      - id: id
        type: u4
  admin_explain:
    seq:
      - id: id
        type: u4
      - id: session
        type: u8
  admin_weight:
    seq:
      - id: id
        type: u4
      - id: session
        type: u8
      - id: weight
        type: u4
        doc: Thousandths.
