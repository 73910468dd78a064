// SPDX-License-Identifier: MIT
// A session under a random script: the first bytes choose slots, sizes and how far the clients have come; then one
// action after the other, each a byte and what it takes. At the end everything is let go, and every request must have
// ended exactly once and nothing may be left.
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/scheduler/registry.h"
#include "proto/messages.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/script.h"
#include "tests/fuzz/session_rig.h"

namespace pmcd::fuzz {
namespace {

const std::array<std::string, 6> kNames{"a", "b", "ab", "c", "none", "no/name"};

/// The daemon's log: an exception that had to be caught is a fault of ours.
class WatchfulSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    if (text.find("exception") != std::string_view::npos || text.starts_with("transfer: ")) broken(std::string(text));
  }
  void flush_() override {}
};

void watch_the_log() {
  static const bool done = [] {
    auto logger = std::make_shared<spdlog::logger>("fuzz", std::make_shared<WatchfulSink>());
    logger->set_level(spdlog::level::warn);  // what is below is only formatted for nobody
    spdlog::set_default_logger(std::move(logger));
    return true;
  }();
  static_cast<void>(done);
}

/// One script being played.
class Play {
 public:
  explicit Play(Script& script) : script_(script), rig_(options(script)) {}

  void run() {
    const std::uint8_t setting = script_.u8();
    rig_.source().set_caching((setting & 1) != 0);
    rig_.source().set_late((setting & 2) != 0);
    for (std::size_t i = 0; i < 4; ++i) {
      if (i < 2 || script_.u8() % 2 == 0) rig_.source().put(kNames[i], content());
    }
    const std::size_t clients = 1 + (setting >> 2) % 3;
    const std::size_t joined = (setting >> 4) % 4;  // most scripts begin with sessions that stand
    for (std::size_t i = 0; i < clients; ++i) {
      client_ = rig_.connect();
      if (joined == 3) continue;
      send(proto::encode(proto::Hello{{}, "fuzzer"}));
      if (joined != 2) rig_.join(client_);
    }
    for (int left = kMostActions; left > 0 && !script_.empty(); --left) act();
    rig_.settle(true);
    rig_.finish();
  }

 private:
  static constexpr int kMostActions = 400;

  static RigOptions options(Script& script) {
    static constexpr std::array<std::size_t, 4> kChunks{40, 256, 1'000, 16'384};
    static constexpr std::array<std::size_t, 4> kQueued{300, 1'024, 4'096, 8'192};
    RigOptions options;
    const std::uint8_t sizes = script.u8();
    options.policy.slots = 1 + sizes % 3;
    options.chunk_bytes = kChunks[(sizes >> 2) % 4];
    options.queued_bytes = kQueued[(sizes >> 4) % 4];
    options.socket_buffer = (sizes & 0xc0) == 0 ? 65'536 : 4'608;
    return options;
  }

  const Content& content() { return contents()[script_.below(static_cast<unsigned>(contents().size()))]; }
  const std::string& name() { return kNames[script_.below(kNames.size())]; }
  /// Few different ones, so that they meet again; 0, which no request may have, now and then.
  std::uint32_t id() {
    const std::uint8_t choice = script_.u8();
    return choice == 0xff ? 0 : 1 + choice % 12u;
  }
  void send(const proto::Bytes& frame) { rig_.send(client_, proto::Channel::request, frame); }
  proto::Channel channel() { return script_.u8() % 4 == 0 ? proto::Channel::data : proto::Channel::request; }

  void act() {
    const std::uint8_t action = script_.u8();
    client_ = (action >> 5) % rig_.clients();
    switch (action & 31) {
      case 0:
      case 1:
        return ask_base();
      case 2:
      case 3:
      case 4:
        return ask_next();
      case 5:
      case 6:
        return ask_packet();
      case 7:
        return ask_list();
      case 8:
      case 9:
        return send(proto::encode(proto::Cancel{id()}));
      case 10: {
        const std::uint8_t choice = script_.u8();
        if (choice < 64) return send(proto::encode(proto::Ping{choice}));
        return rig_.switch_to(policy(choice));
      }
      case 11:
        return any_frame();
      case 12:
        return rig_.send(client_, channel(), script_.bytes(script_.below(24)));
      case 13:
        return hello_or_goodbye();
      case 14:
        return rig_.set_piece(client_, 1 + std::size_t{script_.u8()} * script_.u8());
      case 15:
        if (script_.u8() % 8 == 0) rig_.close(client_, channel());
        return;
      case 16:
        return rig_.join(client_);
      case 17:
        rig_.turn(script_.u8());
        return;
      case 18:
        rig_.turn(1'000'000);
        return;
      case 19:
        return rig_.receive(client_, proto::Channel::request, script_.u8());
      case 20:
        return rig_.receive(client_, proto::Channel::data, 1 + std::size_t{script_.u8()} * 16);
      case 21:
        return rig_.sync(client_);
      case 22:
        return rig_.look(client_);
      case 23:
      case 24:
        return rig_.source().answer(script_.u8(), false);
      case 25:
        return rig_.source().answer(script_.u8(), true);
      case 26:
        return rig_.source().set_late(script_.u8() % 2 == 0);
      case 27:
        return replace();
      case 28:
        return remove();
      case 29:
        return rig_.source().collect(script_.u8());
      case 30:
        return rig_.settle(script_.u8() % 2 == 0);
      default:
        if (script_.u8() % 16 == 0) rig_.drain();
        return;
    }
  }

  /// Any rule, with and without a quantum so short that each chunk is a turn, with and without aging.
  static scheduler::Policy policy(std::uint8_t choice) {
    static constexpr std::array<std::optional<std::size_t>, 3> kSlots{1, 3, std::nullopt};
    scheduler::Policy policy;
    const scheduler::RuleEntry& rule = scheduler::all_rules()[choice % 8];
    policy.rule = rule.name;
    for (const auto& option : rule.options) policy.rule_options.emplace(option.name, option.words[(choice >> 3) % 2]);
    if ((choice & 16) != 0) policy.quantum = scheduler::Time{1};
    if ((choice & 32) != 0) policy.aging = scheduler::Time{1};
    policy.slots = kSlots[choice / 8 % 3];
    policy.uplink = (choice & 64) != 0 ? 1'000 : 0;
    return policy;
  }

  void ask_base() { send(proto::encode(proto::GetBaseMesh{id(), name()})); }

  void ask_next() {
    const std::uint32_t request = id();
    send(proto::encode(proto::GetNextPacket{request, script_.u8() % 8u}));
  }

  void ask_packet() {
    proto::GetPacket message;
    message.id = id();
    const Content& wanted = content();
    message.generation = wanted.mesh.summary.generation;
    const std::uint8_t choice = script_.u8();
    message.packet = choice % 6u;
    const std::uint64_t size = message.packet < wanted.packets.size() ? wanted.packets[message.packet]->size() : 0;
    // At the start, near the end, beyond it, anywhere.
    const std::uint64_t any = script_.u16();
    message.offset = choice < 64    ? 0
                     : choice < 128 ? size - std::min(size, any % 4)
                     : choice < 192 ? any
                                    : any % (size + 1);
    if (choice == 0xff) message.generation = any;
    send(proto::encode(message));
  }

  void ask_list() {
    proto::GetMeshList message;
    message.id = id();
    const std::uint8_t choice = script_.u8();
    if ((choice & 1) != 0) message.filter = name();
    if ((choice & 2) != 0) message.after = name();
    message.most = static_cast<std::uint16_t>((choice >> 2) % 4);
    send(proto::encode(message));
  }

  void any_frame() {
    const proto::Channel where = channel();
    const std::uint8_t type = script_.u8();
    const Input body = script_.bytes(script_.below(16));
    rig_.send(client_, where, proto::make_frame(static_cast<proto::FrameType>(type), body));
  }

  void hello_or_goodbye() {
    if (script_.u8() % 8 == 0) return send(proto::encode(proto::Goodbye{}));
    if (rig_.model(client_).state() == proto::SessionState::fresh) send(proto::encode(proto::Hello{{}, "late"}));
  }

  void replace() {
    const std::string& wanted = kNames[script_.below(5)];
    if (const auto given_way = rig_.source().put(wanted, content())) rig_.retired(*given_way);
  }

  void remove() {
    if (const auto removed = rig_.source().remove(name())) rig_.retired(*removed);
  }

  Script& script_;
  SessionRig rig_;
  std::size_t client_ = 0;
};

}  // namespace

void session(Input input) {
  watch_the_log();
  Script script(input);
  Play play(script);
  play.run();
}

}  // namespace pmcd::fuzz
