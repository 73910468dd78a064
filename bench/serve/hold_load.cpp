// SPDX-License-Identifier: MIT
// The load for memory: many sessions that stand and do nothing, while somebody else looks at the daemon.
#include <sys/resource.h>

#include <iostream>
#include <string>
#include <utility>

#include "bench/serve/link.h"
#include "bench/serve/loads.h"

namespace pmcd::bench {
namespace {

constexpr std::size_t kPingEvery = 97;

/// Prints a line and waits until whoever started this program has looked at the daemon.
void report_and_wait(const nlohmann::json& line) {
  std::cout << line.dump() << std::endl;
  std::string ignored;
  std::getline(std::cin, ignored);
}

void open_mesh(OpenSession& session, const std::string& mesh, std::vector<std::byte>& buffer) {
  proto::GetBaseMesh message;
  message.id = 1;
  message.name = mesh;
  session.requests.socket().send(proto::encode(message));
  expect<proto::MeshOpened>(session.requests.next(buffer));
  while (true) {
    const auto frame = session.data.next(buffer);
    if (frame && frame->type == static_cast<std::uint16_t>(proto::FrameType::chunk)) continue;
    const auto end = expect<proto::TransferEnd>(frame);
    if (end.result != proto::TransferResult::complete) fail("a base mesh was not sent");
    return;
  }
}

void ping(OpenSession& session, std::uint32_t id, std::vector<std::byte>& buffer) {
  session.requests.socket().send(proto::encode(proto::Ping{id}));
  if (expect<proto::Pong>(session.requests.next(buffer)).id != id) fail("a pong with another id");
}

/// What the daemon answers to one session more: "taken", an error's name, or "closed without a word".
std::string try_another(const HoldOptions& options, std::vector<std::byte>& buffer) {
  Link link(Socket::connect(options.port, options.sessions));
  link.socket().send(hello_frame());
  const auto frame = link.next(buffer);
  if (!frame) return link.at_end() ? "closed without a word" : "no answer";
  if (frame->type == static_cast<std::uint16_t>(proto::FrameType::hello_ok)) return "taken";
  return std::string(proto::code_name(expect<proto::ErrorMessage>(frame).code));
}

}  // namespace

void hold_load(const HoldOptions& options) {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);

  std::vector<std::byte> buffer(16 * 1024);
  std::vector<OpenSession> sessions;
  sessions.reserve(options.sessions);
  const Clock::time_point start = Clock::now();
  while (sessions.size() < options.sessions) sessions.push_back(open_session(options.port, sessions.size()));
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  report_and_wait({{"sessions", sessions.size()}, {"seconds", seconds}});

  for (std::size_t number = 0; number < options.opened; ++number) open_mesh(sessions.at(number), options.mesh, buffer);
  report_and_wait({{"opened", options.opened}});

  std::size_t pinged = 0;
  for (std::size_t number = 0; number < sessions.size(); number += kPingEvery) {
    ping(sessions[number], static_cast<std::uint32_t>(number), buffer);
    ++pinged;
  }
  const std::string another = try_another(options, buffer);
  ping(sessions.back(), 1, buffer);
  report_and_wait({{"pinged", pinged + 1}, {"another", another}});
}

}  // namespace pmcd::bench
