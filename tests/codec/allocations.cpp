// SPDX-License-Identifier: MIT
#include "tests/codec/allocations.h"

#include <malloc.h>

#include <cstdlib>
#include <new>

namespace {

std::size_t alive = 0;
std::size_t most_alive = 0;

void* take(std::size_t size) {
  void* const memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  alive += malloc_usable_size(memory);
  if (alive > most_alive) most_alive = alive;
  return memory;
}

void give_back(void* memory) {
  if (memory == nullptr) return;
  alive -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) {
  return take(size);
}
void* operator new[](std::size_t size) {
  return take(size);
}
void operator delete(void* memory) noexcept {
  give_back(memory);
}
void operator delete[](void* memory) noexcept {
  give_back(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, std::size_t /*size*/) noexcept {
  give_back(memory);
}

namespace pmcd::codec::testing {

AllocationMeter::AllocationMeter() : at_start_(alive) {
  most_alive = alive;
}

std::size_t AllocationMeter::peak() const {
  return most_alive - at_start_;
}

}  // namespace pmcd::codec::testing
