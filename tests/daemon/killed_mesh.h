// SPDX-License-Identifier: MIT
// The mesh whose ingest is killed: several packets, large enough that its pages fill more than one write.
#pragma once

#include <cstdint>

#include "tests/store/fake_mesh.h"

namespace pmcd::test {

inline FakeMesh killed_mesh(std::uint64_t seed) {
  return fake_mesh(seed, {500, 3'000, 20'000, 90'000, 300'000});
}

}  // namespace pmcd::test
