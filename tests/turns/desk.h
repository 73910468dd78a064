// SPDX-License-Identifier: MIT
// Turns without sockets: a host whose streams take, send and acknowledge what a test says, on a clock of its own, and
// that writes down what it is told to do. Checks of each request that its chunks follow each other and that it ends
// once.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/turns/turns.h"

namespace pmcd::turns {

class PaperStream final : public Stream {
 public:
  [[nodiscard]] std::uint64_t queued_position() const override { return queued; }
  [[nodiscard]] std::uint64_t unwritten() const override { return queued - written; }
  [[nodiscard]] bool has_room() const override { return unwritten() < 64 * 1024; }
  std::uint64_t acknowledged_position() override { return looked_at = acknowledged; }
  [[nodiscard]] std::uint64_t last_acknowledged() const override { return looked_at; }
  std::optional<TcpState> tcp_state() override { return std::nullopt; }
  bool has_left() override { return sent == written; }
  void bound_unsent(std::size_t bytes) override { unsent_bound = bytes; }

  std::uint64_t queued = 0, written = 0, sent = 0, acknowledged = 0, looked_at = 0;
  std::size_t unsent_bound = 0;
};

class Desk final : public Host {
 public:
  static constexpr std::uint64_t kHead = 34;
  static constexpr std::uint64_t kEnd = 13;

  struct Item {
    SessionKey session = 0;
    std::uint64_t bytes = 0;
    std::uint64_t sent = 0;
    bool ended = false, cancelled = false, released = false, gone = false;
    int interruptions = 0;
  };

  explicit Desk(const std::string& rule, std::optional<std::size_t> slots = 1,
                std::optional<Time> quantum = std::nullopt, double uplink = 0)
      : turns(policy(rule, slots, quantum, uplink), *this, limits) {}

  static scheduler::Policy policy(const std::string& rule, std::optional<std::size_t> slots,
                                  std::optional<Time> quantum, double uplink) {
    scheduler::Policy policy;
    policy.rule = rule;
    policy.slots = slots;
    policy.quantum = quantum;
    policy.uplink = uplink;
    return policy;
  }

  Key ask(SessionKey session, std::uint64_t bytes, std::uint64_t offset = 0) {
    scheduler::Request request;
    request.key = next_++;
    request.session = session;
    request.size_bytes = bytes;
    request.offset_bytes = offset;
    request.asked_at = clock;
    items[request.key] = {session, bytes, offset};
    turns.enqueue(request);
    run();
    return request.key;
  }
  /// What was put off happens.
  void run() {
    while (pump_is_due) {
      pump_is_due = false;
      turns.pump();
    }
  }
  /// Time passes, with all the polls that are due in it.
  void wait(Time time) {
    const Time end = clock + time;
    while (turns.has_to_poll()) {
      const Time next = std::max(turns.poll(), clock + std::chrono::microseconds(1));
      run();
      if (next > end) break;
      clock = next;
    }
    clock = end;
    if (turns.has_to_poll()) turns.poll();
    run();
  }
  /// The socket takes all that is queued, and as the turns go on with more, `most` bytes at most.
  void write(SessionKey session, std::uint64_t most = UINT64_MAX) {
    PaperStream& stream = *streams.at(session);
    while (stream.unwritten() > 0 && most > 0) {
      const std::uint64_t part = std::min(most, stream.unwritten());
      stream.written += part;
      most -= part;
      turns.progress(session);
      run();
    }
  }
  /// The socket takes `bytes` every `pause`, `times` times.
  void write_slowly(SessionKey session, std::uint64_t bytes, Time pause, int times) {
    for (int i = 0; i < times; ++i) {
      clock += pause;
      write(session, bytes);
    }
  }
  void acknowledge(SessionKey session) {
    PaperStream& stream = *streams.at(session);
    stream.acknowledged = stream.sent = stream.written;
  }
  /// Takes and acknowledges all as it comes, until nothing more does.
  void serve(SessionKey session) {
    for (std::uint64_t before = UINT64_MAX; before != streams.at(session)->queued;) {
      before = streams.at(session)->queued;
      write(session);
      acknowledge(session);
      wait(std::chrono::milliseconds(25));
    }
  }
  void leave(SessionKey session) {
    for (const Key key : turns.session_gone(session)) items.at(key).gone = true;
    streams.erase(session);
    run();
  }

  [[nodiscard]] Time now() const override { return clock; }
  void pump_soon() override { pump_is_due = true; }
  void poll_by(Time when) override { EXPECT_GE(when, clock); }
  std::shared_ptr<Stream> stream_of(Key key) override {
    auto& stream = streams[items.at(key).session];
    if (!stream) stream = std::make_shared<PaperStream>();
    return stream;
  }
  std::optional<Content> fetch(Key key) override {
    if (slow_store) return std::nullopt;
    return content(key);
  }
  [[nodiscard]] Content content(Key key) const { return {items.at(key).bytes, !lists.contains(key)}; }
  void send(Key key, std::uint64_t offset, std::size_t size) override {
    if (memory_is_out) throw std::bad_alloc();
    Item& item = items.at(key);
    EXPECT_EQ(offset, item.sent) << "of request " << key;
    EXPECT_FALSE(item.ended || item.gone) << "of request " << key;
    EXPECT_GT(size, 0U);
    item.sent += size;
    EXPECT_LE(item.sent, item.bytes);
    streams.at(item.session)->queued += kHead + size;
    chunks.push_back(key);
  }
  std::size_t take_back(Key /*key*/) override { return 0; }
  void end(Key key, bool is_cancelled) override {
    Item& item = items.at(key);
    EXPECT_FALSE(item.ended || item.gone) << "request " << key << " ends twice";
    item.ended = true;
    item.cancelled = is_cancelled;
    EXPECT_TRUE(is_cancelled || item.sent == item.bytes) << "request " << key;
    if (const auto stream = streams.find(item.session); stream != streams.end()) stream->second->queued += kEnd;
  }
  void interrupted(Key key) override { ++items.at(key).interruptions; }
  void released(Key key) override {
    EXPECT_FALSE(items.at(key).released);
    items.at(key).released = true;
  }
  void broken(Key key, const std::exception& /*error*/) override { leave_now(items.at(key).session); }
  void drop(SessionKey session, Pace::Verdict verdict) override {
    dropped[session] = verdict;
    leave_now(session);
  }

  Limits limits;
  Time clock = std::chrono::seconds(1);
  std::map<Key, Item> items;
  std::map<SessionKey, std::shared_ptr<PaperStream>> streams;
  std::vector<Key> chunks;  ///< whose they were, in the order in which they were sent
  std::map<SessionKey, Pace::Verdict> dropped;
  std::set<Key> lists;  ///< may not be interrupted
  bool slow_store = false;
  bool memory_is_out = false;
  bool pump_is_due = false;
  Turns turns;

 private:
  void leave_now(SessionKey session) {
    for (const Key key : turns.session_gone(session)) items.at(key).gone = true;
  }

  Key next_ = 1;
};

}  // namespace pmcd::turns
