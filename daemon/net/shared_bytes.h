// SPDX-License-Identifier: MIT
// Bytes that many hold and nobody changes: a packet on its way to several sockets is in memory once.
#pragma once

#include <memory>

#include "proto/bytes.h"

namespace pmcd::net {

using SharedBytes = std::shared_ptr<const proto::Bytes>;

}  // namespace pmcd::net
