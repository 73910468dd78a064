// SPDX-License-Identifier: MIT
// The rules of session.h, read off the state machine in docs/PROTOCOL.md.
#include "proto/session.h"

#include <algorithm>

namespace pmcd::proto {

namespace {

bool is_request(FrameType type) {
  switch (type) {
    case FrameType::get_mesh_list:
    case FrameType::get_base_mesh:
    case FrameType::get_next_packet:
    case FrameType::get_packet:
    case FrameType::cancel:
      return true;
    default:
      return false;
  }
}

bool is_admin_request(FrameType type) {
  switch (type) {
    case FrameType::admin_list:
    case FrameType::admin_show:
    case FrameType::admin_remove:
    case FrameType::admin_status:
    case FrameType::ingest_begin:
    case FrameType::ingest_data:
    case FrameType::ingest_commit:
    case FrameType::admin_rules:
    case FrameType::admin_rule:
    case FrameType::admin_set_rule:
    case FrameType::admin_history:
    case FrameType::admin_revert:
    case FrameType::admin_queue:
    case FrameType::admin_clients:
    case FrameType::admin_explain:
    case FrameType::admin_weight:
      return true;
    default:
      return false;
  }
}

FrameType first_frame(Channel channel) {
  switch (channel) {
    case Channel::request:
      return FrameType::hello;
    case Channel::data:
      return FrameType::join;
    case Channel::admin:
      break;
  }
  return FrameType::admin_hello;
}

}  // namespace

ErrorCode check_client_frame(Channel channel, SessionState state, std::uint16_t number) {
  const auto type = static_cast<FrameType>(number);
  if (state == SessionState::fresh) {
    return type == first_frame(channel) ? ErrorCode::none : ErrorCode::wrong_state;
  }
  if (type_name(number) == nullptr) return ErrorCode::unknown_type;
  if (channel == Channel::data) return ErrorCode::wrong_state;
  if (type == FrameType::ping || type == FrameType::goodbye) return ErrorCode::none;
  if (channel == Channel::admin) return is_admin_request(type) ? ErrorCode::none : ErrorCode::wrong_state;
  if (!is_request(type)) return ErrorCode::wrong_state;
  return state == SessionState::joined ? ErrorCode::none : ErrorCode::not_joined;
}

ErrorCode OpenRequests::open(std::uint32_t id) {
  if (id == 0) return ErrorCode::malformed;
  if (is_open(id)) return ErrorCode::duplicate_id;
  if (count_ == ids_.size()) return ErrorCode::too_many_requests;
  ids_[count_++] = id;
  return ErrorCode::none;
}

bool OpenRequests::end(std::uint32_t id) {
  const auto used = ids_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto found = std::find(ids_.begin(), used, id);
  if (found == used) return false;
  --count_;
  *found = ids_[count_];
  return true;
}

bool OpenRequests::is_open(std::uint32_t id) const {
  const auto used = ids_.begin() + static_cast<std::ptrdiff_t>(count_);
  return std::find(ids_.begin(), used, id) != used;
}

}  // namespace pmcd::proto
