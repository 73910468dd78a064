// SPDX-License-Identifier: MIT
// A few small generated meshes, encoded once: what the targets of the codec begin with and the seeds are made of.
#pragma once

#include <cstddef>
#include <vector>

namespace pmcd::fuzz {

/// For each mesh its packets. Between them: open and closed, lossless and quantised, several components, isolated
/// vertices, growing precision, each way of the exactness section, best effort. Always the same.
const std::vector<std::vector<std::vector<std::byte>>>& sample_packets();

}  // namespace pmcd::fuzz
