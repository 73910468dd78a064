// SPDX-License-Identifier: MIT
// getaddrinfo on a thread of its own.
#include "client/lookup.h"

#include <netdb.h>
#include <sys/socket.h>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace pmcd::client {

using boost::asio::ip::tcp;

/// Shared with the thread, which may outlive the Lookup.
struct Lookup::Answer {
  std::mutex mutex;
  boost::asio::io_context* io = nullptr;  ///< to be woken; nullptr when nobody waits any more
  bool done = false;
  Endpoints endpoints;
  std::string failure;

  void give(Endpoints found, std::string why) {
    const std::lock_guard lock(mutex);
    endpoints = std::move(found);
    failure = std::move(why);
    done = true;
    if (io != nullptr) boost::asio::post(*io, [] {});
  }
};

namespace {

std::pair<Endpoints, std::string> ask_the_system(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_ADDRCONFIG;
  addrinfo* list = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), nullptr, &hints, &list); error != 0) {
    return {Endpoints{}, ::gai_strerror(error)};
  }
  Endpoints found;
  for (const addrinfo* entry = list; entry != nullptr; entry = entry->ai_next) {
    tcp::endpoint endpoint;
    if (entry->ai_addrlen > endpoint.capacity()) continue;
    endpoint.resize(entry->ai_addrlen);
    std::memcpy(endpoint.data(), entry->ai_addr, entry->ai_addrlen);
    endpoint.port(port);
    found.push_back(endpoint);
  }
  ::freeaddrinfo(list);
  std::string why = found.empty() ? "it has no address" : "";
  return {std::move(found), std::move(why)};
}

}  // namespace

Lookup::Lookup(boost::asio::io_context& io, const std::string& host, std::uint16_t port)
    : answer_(std::make_shared<Answer>()) {
  boost::system::error_code no_number;
  const auto number = boost::asio::ip::make_address(host, no_number);
  if (!no_number) {
    answer_->give({tcp::endpoint(number, port)}, {});
    return;
  }
  answer_->io = &io;
  try {
    std::thread([answer = answer_, host, port] {
      auto [endpoints, why] = ask_the_system(host, port);
      answer->give(std::move(endpoints), std::move(why));
    }).detach();
  } catch (const std::system_error& error) {
    answer_->give({}, error.what());
  }
}

Lookup::~Lookup() {
  const std::lock_guard lock(answer_->mutex);
  answer_->io = nullptr;
}

bool Lookup::done() const {
  const std::lock_guard lock(answer_->mutex);
  return answer_->done;
}

Endpoints Lookup::endpoints() const {
  const std::lock_guard lock(answer_->mutex);
  return answer_->endpoints;
}

std::string Lookup::failure() const {
  const std::lock_guard lock(answer_->mutex);
  return answer_->failure;
}

}  // namespace pmcd::client
