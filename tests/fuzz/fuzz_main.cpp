// SPDX-License-Identifier: MIT
// libFuzzer's way in. PMCD_FUZZ_TARGET is one of the functions of target.h.
#include <cstdint>

#include "tests/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  pmcd::fuzz::PMCD_FUZZ_TARGET(std::as_bytes(std::span(data, size)));
  return 0;
}
