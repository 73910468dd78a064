// SPDX-License-Identifier: MIT
#include "codec/base/front.h"

namespace pmcd::codec {

bool Front::runs(std::uint32_t a, std::uint32_t b) const {
  std::uint32_t h = first_out_[a];
  for (int i = 0; i < 64 && h != kNone; ++i, h = next_out_[h]) {
    if (target(h) == b) return true;
  }
  return false;
}

std::uint32_t Front::add_vertex() {
  first_open_.push_back(kNone);
  first_out_.push_back(kNone);
  valence_.push_back(0);
  return vertex_count() - 1;
}

std::uint32_t Front::add_first_face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const std::uint32_t h = 3 * face_count();
  faces_.push_back({a, b, c});
  for (std::uint32_t i = h; i < h + 3; ++i) open_up(i);
  link(h, h + 1);
  link(h + 1, h + 2);
  link(h + 2, h);
  return h / 3;
}

std::uint32_t Front::attach(std::uint32_t gate, std::uint32_t entry, std::uint32_t v) {
  const std::uint32_t h = 3 * face_count();
  faces_.push_back({target(gate), origin(gate), v});
  open_up(h);
  open_up(h + 1);
  open_up(h + 2);
  close(h);
  close(gate);
  const std::uint32_t left = before_[gate];
  const std::uint32_t right = after_[gate];
  link(left, h + 1);
  if (entry == kNone) {
    link(h + 1, h + 2);
    link(h + 2, right);
  } else {
    const std::uint32_t arriving = before_[entry];
    link(h + 1, entry);
    link(arriving, h + 2);
    link(h + 2, right);
  }
  close_if_met(h + 1);
  close_if_met(h + 2);
  return h / 3;
}

void Front::end_at_boundary(std::uint32_t gate) {
  close(gate);
  boundary_[gate] = 1;
}

void Front::open_up(std::uint32_t h) {
  after_.push_back(h);
  before_.push_back(h);
  boundary_.push_back(0);
  place_.push_back(static_cast<std::uint32_t>(open_.size()));
  open_.push_back(h);
  std::uint32_t& head = first_open_[origin(h)];
  next_open_.push_back(head);
  head = h;
  std::uint32_t& newest = first_out_[origin(h)];
  next_out_.push_back(newest);
  newest = h;
  ++valence_[origin(h)];
}

void Front::close(std::uint32_t h) {
  const std::uint32_t last = open_.back();
  open_[place_[h]] = last;
  place_[last] = place_[h];
  open_.pop_back();
  place_[h] = kNone;
}

void Front::close_if_met(std::uint32_t h) {
  std::uint32_t* head = &first_open_[target(h)];
  while (*head != kNone) {
    const std::uint32_t other = *head;
    if (!is_open(other)) {
      *head = next_open_[other];
      continue;
    }
    if (target(other) == origin(h)) {
      // Both leave their chains; wherever they stood, the chains join across the closed edge.
      const std::uint32_t before_h = before_[h];
      const std::uint32_t after_h = after_[h];
      const std::uint32_t before_other = before_[other];
      const std::uint32_t after_other = after_[other];
      link(before_h, after_other);
      link(before_other, after_h);
      close(h);
      close(other);
      return;
    }
    head = &next_open_[other];
    ++steps_;
  }
}

}  // namespace pmcd::codec
