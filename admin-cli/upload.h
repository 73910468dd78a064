// SPDX-License-Identifier: GPL-3.0-or-later
// Sending one encoded mesh to the daemon. Nothing is visible there before this returns success.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "admin-cli/admin_line.h"
#include "proto/admin.h"

namespace pmcd::admin {

/// Told how far the upload is, from 0 to 1.
using UploadProgress = std::function<void(double fraction)>;

/// Sends directory and packets and waits until they are committed. Large meshes may take the daemon minutes.
std::variant<proto::IngestOk, Failure> upload(AdminLine& line, const std::string& name, bool replace,
                                              std::span<const std::byte> directory,
                                              const std::vector<std::span<const std::byte>>& packets,
                                              const UploadProgress& progress);

}  // namespace pmcd::admin
