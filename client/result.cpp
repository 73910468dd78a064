// SPDX-License-Identifier: MIT
// Names of failures.
#include "client/result.h"

namespace pmcd::client {

const char* failure_name(Failure failure) {
  switch (failure) {
    case Failure::bad_address:
      return "bad_address";
    case Failure::cannot_reach:
      return "cannot_reach";
    case Failure::refused:
      return "refused";
    case Failure::violation:
      return "violation";
    case Failure::damaged:
      return "damaged";
    case Failure::limit_exceeded:
      return "limit_exceeded";
    case Failure::timed_out:
      return "timed_out";
    case Failure::lost:
      return "lost";
    case Failure::no_such_handle:
      return "no_such_handle";
    case Failure::no_such_level:
      return "no_such_level";
    case Failure::bad_state:
      return "bad_state";
    case Failure::cancelled:
      return "cancelled";
  }
  return "violation";
}

}  // namespace pmcd::client
