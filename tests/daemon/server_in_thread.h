// SPDX-License-Identifier: MIT
// A whole server in this process, on free ports and in a folder of its own, with limits that a test may shorten.
#pragma once

#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "daemon/net/asio.h"
#include "daemon/net/server.h"
#include "daemon/scheduler/policy.h"
#include "daemon/store/store_thread.h"
#include "tests/store/fake_mesh.h"
//
#include <boost/asio/detached.hpp>

namespace pmcd::test {

class ServerInThread {
 public:
  explicit ServerInThread(net::Limits limits = {}, std::size_t slots = 1, store::UploadLimits uploads = {})
      : ServerInThread(limits, fifo(slots), uploads) {}
  ServerInThread(net::Limits limits, scheduler::Policy policy, store::UploadLimits uploads = {}) {
    writer_ = store::StoreThread::start(database()).value();
    reader_ = store::StoreThread::start(database()).value();
    net::ServerOptions options;
    options.request_port = 0;
    options.data_port = 0;
    options.admin_socket = admin_socket();
    options.version = "test";
    options.limits = limits;
    options.uploads = uploads;
    net::PolicySources sources{scheduler::written(policy), {}, {}};
    server_ = std::make_unique<net::Server>(io_, *reader_, *writer_, std::move(sources), options);
    const auto error = server_->start();
    EXPECT_FALSE(error) << *error;
    request_port_ = server_->request_port();
    data_port_ = server_->data_port();
    thread_ = std::thread([this] { io_.run(); });
  }
  ServerInThread(const ServerInThread&) = delete;
  ServerInThread& operator=(const ServerInThread&) = delete;
  ~ServerInThread() { EXPECT_TRUE(drain()) << "something in the server did not end"; }

  static scheduler::Policy fifo(std::size_t slots) {
    scheduler::Policy policy;
    policy.slots = slots;
    return policy;
  }

  /// Ends the server as SIGTERM does; whether everything in it ended.
  bool drain() {
    if (!thread_.joinable()) return true;
    bool ended = false;
    net::asio::co_spawn(io_, end(ended), net::asio::detached);
    thread_.join();
    // What still runs in a server that did not end goes with io_, after it: then the server has to stay.
    if (ended) server_.reset();
    static_cast<void>(server_.release());
    return ended;
  }

  /// Runs `look(server)` on the server's thread.
  template <typename Look>
  auto ask(Look look) {
    std::promise<decltype(look(*server_))> answer;
    net::asio::post(io_, [&] { answer.set_value(look(*server_)); });
    return answer.get_future().get();
  }
  [[nodiscard]] std::size_t sessions() {
    return ask([](net::Server& server) { return server.sessions(); });
  }

  [[nodiscard]] std::uint16_t request_port() const { return request_port_; }
  [[nodiscard]] std::uint16_t data_port() const { return data_port_; }
  [[nodiscard]] std::string database() const { return folder_.file("meshes.db"); }
  [[nodiscard]] std::string admin_socket() const { return folder_.file("admin.sock"); }
  /// The threads of the database.
  [[nodiscard]] store::StoreThread& reader() { return *reader_; }
  [[nodiscard]] store::StoreThread& writer() { return *writer_; }

 private:
  net::awaitable<void> end(bool& ended) {
    ended = co_await server_->drain();
    io_.stop();
  }

  TemporaryFolder folder_;
  net::asio::io_context io_{1};
  std::unique_ptr<store::StoreThread> writer_;
  std::unique_ptr<store::StoreThread> reader_;
  std::unique_ptr<net::Server> server_;
  std::uint16_t request_port_ = 0;
  std::uint16_t data_port_ = 0;
  std::thread thread_;
};

}  // namespace pmcd::test
