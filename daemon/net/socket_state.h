// SPDX-License-Identifier: MIT
// What only the kernel knows of a socket: unacknowledged bytes, and who is at the other end of a Unix socket.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace pmcd::net {

/// Bytes written to a TCP socket that the peer has not acknowledged (SIOCOUTQ); 0 if the socket is no longer open.
std::uint64_t unacknowledged_bytes(int socket);

/// Bytes of them that the kernel has not sent yet (SIOCOUTQNSD).
std::uint64_t unsent_bytes(int socket);

/// The kernel takes no more once it holds so many unsent bytes (TCP_NOTSENT_LOWAT), so that what is written is soon on
/// its way.
void bound_unsent(int socket, std::size_t bytes);

struct PeerIdentity {
  uid_t uid = 0;
  pid_t pid = 0;
};

/// The process that connected to a Unix socket (SO_PEERCRED).
std::optional<PeerIdentity> peer_identity(int socket);

/// Lets the kernel find out by itself that a silent peer is gone (keep-alive after a minute), and sends without delay.
void tune_tcp(int socket);

/// What the kernel keeps of what was written and is not acknowledged: about twice `bytes`, its own bookkeeping
/// included, where it would grow to megabytes by itself. For channels that carry short answers: it limits what is under
/// way at a time, and so the speed of the connection.
void bound_send_buffer(int socket, std::size_t bytes);

}  // namespace pmcd::net
