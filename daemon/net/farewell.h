// SPDX-License-Identifier: MIT
// The last word to a peer for whom there is no place to linger in: written and closed within one turn of the loop.
#pragma once

#include "proto/frame.h"

namespace pmcd::net {

/// Writes `frame` as far as the socket takes it at once, says that nothing follows, and reads away what has come. The
/// caller closes the socket. What the peer sends later finds no socket and resets the connection, which on some systems
/// takes an unread frame with it; a channel that lingers (Channel::finish) has not that weakness. Never waits; the
/// costs are a few system calls and at most 64 KiB read. REQUIRES: a fresh socket, to which nothing else was written.
void say_farewell(int socket, proto::ByteView frame);

}  // namespace pmcd::net
