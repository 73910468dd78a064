// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files in and out. A file is written under a temporary name beside its own and renamed, so that nobody ever sees
// half of it. Knows no format.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codec/import/error.h"

namespace pmcd::import {

/// The bytes of a regular file. Errors: cannot_read.
ImportResult<std::vector<std::byte>> load_file(const std::string& path);

/// Replaces or creates `path`, through a symbolic link if it is one. On error nothing of it is left behind and an older
/// file stays as it was. A path that names a pipe or device is written directly. Errors: cannot_write.
ImportFailure save_file(const std::string& path, std::span<const std::byte> bytes);

/// The extension of a path without its dot, in lower case; empty if there is none.
std::string extension_of(const std::string& path);

}  // namespace pmcd::import
