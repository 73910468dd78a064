// SPDX-License-Identifier: MIT
// Reads /proc/self/status; writing 5 to /proc/self/clear_refs sets the peak back to what is resident now.
#include "bench/codec/process_memory.h"

#include <malloc.h>

#include <fstream>
#include <iostream>
#include <string>

namespace pmcd::bench {
namespace {

std::uint64_t status_bytes(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(field + ":")) return std::stoull(line.substr(field.size() + 1)) * 1024;
  }
  std::cerr << "codec_bench: /proc/self/status has no " << field << '\n';
  return 0;
}

}  // namespace

PeakMemory::PeakMemory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
  before_bytes_ = status_bytes("VmRSS");
}

std::uint64_t PeakMemory::growth_bytes() const {
  const std::uint64_t peak = status_bytes("VmHWM");
  return peak > before_bytes_ ? peak - before_bytes_ : 0;
}

}  // namespace pmcd::bench
