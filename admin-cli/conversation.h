// SPDX-License-Identifier: GPL-3.0-or-later
// Asking the daemon for JSON documents: one connection, one request after the other. And the way of most commands: ask
// once, print.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "admin-cli/admin_line.h"
#include "admin-cli/commands.h"
#include "admin-cli/document.h"

namespace pmcd::admin {

class Conversation {
 public:
  static std::variant<Conversation, Failure> open(const std::string& socket);

  /// Sends a request, whose id is set here, and gathers its document. After a refusal with a code the next request may
  /// be asked; other failures are of the connection.
  template <typename M>
  std::variant<ordered_json, Failure> ask(M request) {
    request.id = ++last_id_;
    return gather(encode(request));  // by argument: messages live in several headers
  }

 private:
  explicit Conversation(AdminLine line) : line_(std::move(line)) {}
  std::variant<ordered_json, Failure> gather(const proto::Bytes& request);

  AdminLine line_;
  std::uint32_t last_id_ = 0;
};

/// Prints a document: lines for people, or with --json itself.
using Print = void (*)(const ordered_json& document);

/// Prints an answer, or reports why there is none. Answers the exit code.
int show_answer(const Common& common, const std::string& command, const std::variant<ordered_json, Failure>& answer,
                Print print);

/// Asks one thing over a connection of its own and prints the answer. Answers the exit code.
template <typename M>
int run(const Common& common, const std::string& command, M request, Print print) {
  auto opened = Conversation::open(common.socket);
  if (const auto* failed = std::get_if<Failure>(&opened)) return report(common, command, *failed);
  return show_answer(common, command, std::get<Conversation>(opened).ask(std::move(request)), print);
}

void print_lines(const Lines& lines);

}  // namespace pmcd::admin
