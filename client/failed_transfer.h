// SPDX-License-Identifier: MIT
// What to tell of a transfer that did not end as complete. Not part of the library's public face.
#pragma once

#include <string>

#include "client/result.h"
#include "proto/messages.h"

namespace pmcd::client {

/// refused, with the server's code, if the transfer failed; else violation: nobody asked for such an end.
inline Error failed_transfer(const proto::TransferEnd& end) {
  if (end.result == proto::TransferResult::failed) {
    const proto::CodeInfo* info = proto::find_code(static_cast<std::uint16_t>(end.code));
    return {Failure::refused, end.code,
            "the server could not finish the transfer (" + std::string(proto::code_name(end.code)) + ")" +
                (info == nullptr ? std::string{} : ": " + std::string(info->sentence))};
  }
  return {Failure::violation, proto::ErrorCode::none,
          std::string("the server broke the protocol: a transfer ended as ") + proto::result_name(end.result)};
}

}  // namespace pmcd::client
