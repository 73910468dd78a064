// SPDX-License-Identifier: GPL-3.0-or-later
// Gathering the pieces of an answer.
#include "admin-cli/conversation.h"

#include <chrono>
#include <cstddef>
#include <iostream>

#include "proto/admin.h"

namespace pmcd::admin {

namespace {

constexpr std::chrono::milliseconds kAnswerPatience{60'000};
constexpr std::size_t kMaxAnswerBytes = std::size_t{256} << 20;

Failure nonsense(const std::string& what) {
  return {kRefused, proto::ErrorCode::none, "the daemon's answer " + what};
}

}  // namespace

std::variant<Conversation, Failure> Conversation::open(const std::string& socket) {
  auto opened = AdminLine::open(socket);
  if (auto* failed = std::get_if<Failure>(&opened)) return std::move(*failed);
  return Conversation(std::move(std::get<AdminLine>(opened)));
}

std::variant<ordered_json, Failure> Conversation::gather(const proto::Bytes& request) {
  if (auto failed = line_.send(request)) return *failed;
  std::string text;
  for (bool last = false; !last;) {
    auto answer = line_.receive(kAnswerPatience);
    if (auto* failed = std::get_if<Failure>(&answer)) return std::move(*failed);
    auto read = read_as<proto::AdminAnswer>(std::get<Answer>(answer));
    if (auto* failed = std::get_if<Failure>(&read)) return std::move(*failed);
    const auto& piece = std::get<proto::AdminAnswer>(read);
    if (piece.id != last_id_) return nonsense("is to another request");
    text += piece.text;
    last = piece.last;
    if (text.size() > kMaxAnswerBytes) return nonsense("does not end");
  }
  auto document = ordered_json::parse(text, nullptr, false);
  if (!document.is_object()) return nonsense("is not a JSON object");
  return document;
}

int show_answer(const Common& common, const std::string& command, const std::variant<ordered_json, Failure>& answer,
                Print print) {
  if (const auto* failed = std::get_if<Failure>(&answer)) return report(common, command, *failed);
  const auto& document = std::get<ordered_json>(answer);
  if (common.json) {
    std::cout << document.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  } else {
    print(document);
  }
  return kDone;
}

void print_lines(const Lines& lines) {
  for (const std::string& line : lines) std::cout << line << '\n';
}

}  // namespace pmcd::admin
