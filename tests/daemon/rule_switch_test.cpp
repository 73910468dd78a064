// SPDX-License-Identifier: MIT
// What the commands that change the rule and look at its queue answer, and what a new rule does at once. Switches under
// load: rule_switch_load_test.cpp.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "daemon/net/queue_view.h"
#include "daemon/net/rule_json.h"
#include "daemon/scheduler/registry.h"
#include "proto/admin_rules.h"
#include "tests/daemon/busy_thread.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using namespace std::string_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

TEST(RuleSwitch, IsRefusedByNameAndTheOldRuleGoesOn) {
  ServerInThread server;
  auto admin = RawAdmin::open(server.admin_socket());
  const auto set = [&](std::string rule, std::vector<proto::RuleOptionText> options) {
    proto::AdminSetRule message;
    message.id = 5;
    message.rule = std::move(rule);
    message.options = std::move(options);
    return admin.answer(proto::encode(message));
  };
  EXPECT_EQ(json::parse(set("spf", {}))["after"]["text"], "spf aging=0 quantum=0 slots=1 uplink=0");
  EXPECT_EQ(set("lottery", {}), "error: bad_rule");
  EXPECT_EQ(set("spf", {{"burst", "2"}}), "error: bad_option");
  EXPECT_EQ(set("fcsf", {{"burst", "3"}}), "error: bad_option");
  EXPECT_EQ(set("fcsf", {{"burst", "2"}, {"burst", "1"}}), "error: bad_option");
  EXPECT_EQ(set("fcsf", {{"quantum", "soon"}}), "error: bad_option");
  const json rule = json::parse(admin.answer(proto::encode(proto::AdminRule{6})));
  EXPECT_EQ(rule["rule"], "spf");
  EXPECT_EQ(rule["version"], 1);
  EXPECT_EQ(rule["by"]["uid"], ::getuid());
  EXPECT_EQ(rule["by"]["pid"], ::getpid());
  EXPECT_EQ(rule["sources"]["rule"], "live change");
}

TEST(RuleSwitch, GuardedAgainstALostUpdateAndBack) {
  ServerInThread server;
  auto admin = RawAdmin::open(server.admin_socket());
  const auto set = [&](const std::string& rule, std::optional<std::uint64_t> if_version, bool dry_run = false) {
    proto::AdminSetRule message;
    message.id = 5;
    message.rule = rule;
    message.terms = {dry_run, if_version};
    return admin.answer(proto::encode(message));
  };
  const json tried = json::parse(set("lcfs", 0, true));
  EXPECT_FALSE(tried["changed"]) << "a dry run";
  EXPECT_TRUE(tried["would_change"]);
  EXPECT_TRUE(json::parse(set("fifo", 0, true))["would_change"]) << "of where it comes from";
  EXPECT_TRUE(json::parse(set("lcfs", 0))["changed"]);
  EXPECT_EQ(set("fair", 0), "error: version_changed");
  EXPECT_TRUE(json::parse(set("fair", 1))["changed"]);
  EXPECT_FALSE(json::parse(set("fair", 2))["changed"]) << "nothing would differ";
  EXPECT_FALSE(json::parse(set("fair", 2, true))["would_change"]);

  proto::AdminRevert revert{9, {}, 1};
  EXPECT_EQ(json::parse(admin.answer(proto::encode(revert)))["after"]["rule"], "lcfs");
  revert.change = 0;
  EXPECT_EQ(json::parse(admin.answer(proto::encode(revert)))["after"]["rule"], "fifo");
  revert.change = 77;
  EXPECT_EQ(admin.answer(proto::encode(revert)), "error: unknown_change");

  const json history = json::parse(admin.answer(proto::encode(proto::AdminHistory{10, 0})))["changes"];
  ASSERT_EQ(history.size(), 4U);
  EXPECT_EQ(history[0]["number"], 4);
  EXPECT_TRUE(history[0]["rule"].is_null());
  EXPECT_EQ(history[0]["reverts"], 0);
  EXPECT_EQ(history[1]["rule"], "lcfs");
  EXPECT_EQ(history[1]["reverts"], 1);
  EXPECT_EQ(history[3]["rule"], "lcfs");
  EXPECT_TRUE(history[3]["reverts"].is_null());
}

/// A client that reads nothing keeps the one slot; what waits behind it is shown in the rule's order, with reasons.
TEST(RuleSwitch, TheQueueShowsWhoIsNextAndWhy) {
  ServerInThread server;
  auto admin = RawAdmin::open(server.admin_socket());
  ASSERT_EQ(admin.ingest("big", fake_mesh(1, {3'000'000, 100})), "ok");
  ASSERT_EQ(admin.ingest("small", fake_mesh(2, {700, 100})), "ok");
  auto stuck = RawSession::open(server.request_port(), 4'096);
  stuck.open_mesh(1, "big");
  ASSERT_TRUE(stuck.data.stirs(kPatience));
  auto first = RawSession::open(server.request_port());
  first.open_mesh(1, "big");
  auto second = RawSession::open(server.request_port());
  second.open_mesh(1, "small");

  const auto queue = [&] { return json::parse(admin.answer(proto::encode(proto::AdminQueue{3}))); };
  const auto waits = [&] { return queue()["waiting"] == 2; };
  for (int tries = 0; tries < 200 && !waits(); ++tries) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  json shown = queue()["requests"];
  ASSERT_EQ(shown.size(), 3U);
  EXPECT_EQ(shown[0]["state"], "running");
  EXPECT_EQ(shown[0]["mesh"], "big");
  EXPECT_EQ(shown[1]["mesh"], "big");
  EXPECT_EQ(shown[1]["rank"], 1);
  EXPECT_EQ(shown[2]["mesh"], "small");

  proto::AdminSetRule spf;
  spf.id = 4;
  spf.rule = "spf";
  EXPECT_TRUE(json::parse(admin.answer(proto::encode(spf)))["changed"]);
  shown = queue()["requests"];
  ASSERT_EQ(shown.size(), 3U);
  EXPECT_EQ(shown[1]["mesh"], "small");
  EXPECT_EQ(shown[1]["reason"], "packet of 722 B");
  EXPECT_EQ(shown[2]["reason"], "packet of 3 MB");

  const std::uint64_t client = shown[2]["client"];
  const json why = json::parse(admin.answer(proto::encode(proto::AdminExplain{5, client})));
  EXPECT_FALSE(why["next"]);
  EXPECT_EQ(why["summary"], "waits for packet 0 of \"big\" behind 1 other: packet of 3 MB; next is client " +
                                std::to_string(shown[1]["client"].get<std::uint64_t>()) + ": packet of 722 B");
  EXPECT_EQ(why["requests"].size(), 3U);
  EXPECT_EQ(why["requests"][2]["mine"], true);
  EXPECT_EQ(why["waiting"], 2);
  EXPECT_EQ(why["more"], 0);
  EXPECT_EQ(admin.answer(proto::encode(proto::AdminExplain{6, 4711})), "error: unknown_client");

  const json clients = json::parse(admin.answer(proto::encode(proto::AdminClients{7})))["clients"];
  ASSERT_EQ(clients.size(), 3U);
  EXPECT_EQ(clients[1]["client"], client);
  EXPECT_EQ(clients[1]["waiting"], 1);
  EXPECT_EQ(clients[1]["mesh"], "big");
  EXPECT_EQ(clients[1]["level"], 0);
  EXPECT_EQ(clients[1]["levels"], 2);
  EXPECT_TRUE(clients[1]["speed_kbit"].is_null());
  const json weight = json::parse(admin.answer(proto::encode(proto::AdminWeight{8, client, 2'500})));
  EXPECT_EQ(weight["before"], 1.0);
  EXPECT_EQ(weight["weight"], 2.5);
  EXPECT_EQ(weight["rule"], "spf");
  EXPECT_EQ(weight["counts"], false);
  EXPECT_TRUE(scheduler::find_rule("fair")->goes_by_weight);
  EXPECT_EQ(json::parse(admin.answer(proto::encode(proto::AdminClients{9})))["clients"][1]["weight"], 2.5);
}

TEST(QueueView, IsShortenedButForTheClientsOwnAndTheNext) {
  net::QueueView queue;
  for (const std::size_t rank : {0U, 0U, 0U, 1U, 2U, 3U, 4U}) {
    queue.requests.emplace_back();
    queue.requests.back().rank = rank;
    queue.requests.back().client = rank == 3 ? 7 : 1;
  }
  queue.more = 10;
  net::shorten(queue, 7, 7);
  EXPECT_EQ(queue.requests.size(), 7U);
  net::shorten(queue, 2, 7);
  std::vector<std::size_t> ranks;
  for (const net::RequestView& request : queue.requests) ranks.push_back(request.rank);
  EXPECT_EQ(ranks, (std::vector<std::size_t>{0, 0, 1, 3}));
  EXPECT_EQ(queue.more, 13U);
}

/// What is blocked hides nothing that waits, and a client is next with whichever of its requests is.
TEST(RuleJson, ExplainsTheBestOfTheClientsRequests) {
  using State = net::RequestView::State;
  const auto request = [](State state, std::size_t rank, std::uint64_t client) {
    net::RequestView one;
    one.state = state;
    one.rank = rank;
    one.client = client;
    one.mesh = "m" + std::to_string(rank);
    return one;
  };
  net::SessionView session;
  session.key = 7;
  const auto explained = [&](std::vector<net::RequestView> requests) {
    net::QueueView queue;
    queue.requests = std::move(requests);
    const json answer = json::parse(net::explain_json(scheduler::Policy(), session, queue));
    return std::pair(answer["next"].get<bool>(), answer["summary"].get<std::string>());
  };
  const auto blocked = request(State::blocked, 0, 7);
  EXPECT_EQ(explained({blocked, request(State::waiting, 1, 7)}), std::pair(true, "is next with packet 0 of \"m1\": "s));
  EXPECT_EQ(explained({blocked, request(State::waiting, 1, 8), request(State::waiting, 2, 7)}),
            std::pair(false, "waits for packet 0 of \"m2\" behind 1 other: ; next is client 8: "s));
  EXPECT_EQ(explained({request(State::running, 0, 7), blocked, request(State::waiting, 1, 7)}),
            std::pair(true, "is being served: packet 0 of \"m0\""s));
  EXPECT_EQ(explained({blocked, request(State::waiting, 1, 8)}),
            std::pair(false, "was interrupted and has not taken yet what was sent of packet 0 of \"m0\""s));
}

/// Of two changes at once the later one says that the other's rule was in force before it.
TEST(RuleSwitch, OfTwoAtOnceTheLaterFollowsTheEarlier) {
  ServerInThread server;
  auto one = RawAdmin::open(server.admin_socket());
  auto other = RawAdmin::open(server.admin_socket());
  proto::AdminSetRule lcfs;
  lcfs.id = 4;
  lcfs.rule = "lcfs";
  proto::AdminSetRule fair = lcfs;
  fair.rule = "fair";
  {
    const Busy writer(server.writer());
    one.connection.send(proto::encode(lcfs));
    other.connection.send(proto::encode(fair));
    // Both wait for the store by then.
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  const json first = json::parse(one.read_answer());
  const json second = json::parse(other.read_answer());
  const bool in_order = first["after"]["version"] == 1;
  const json& earlier = in_order ? first : second;
  const json& later = in_order ? second : first;
  EXPECT_EQ(earlier["before"]["rule"], "fifo");
  EXPECT_EQ(later["before"], earlier["after"]);
  EXPECT_EQ(later["after"]["version"], 2);
}

/// Of a long queue an explanation has the head, and the client's own requests wherever they stand.
TEST(RuleSwitch, AnExplanationIsBounded) {
  constexpr std::size_t kLists = proto::kMaxOpenRequests;
  constexpr std::size_t kSessions = 130;
  ServerInThread server;
  auto admin = RawAdmin::open(server.admin_socket());
  ASSERT_EQ(admin.ingest("big", fake_mesh(1, {3'000'000, 100})), "ok");
  auto stuck = RawSession::open(server.request_port(), 4'096);
  stuck.open_mesh(1, "big");
  ASSERT_TRUE(stuck.data.stirs(kPatience));
  std::vector<RawSession> sessions;
  for (std::size_t n = 0; n < kSessions; ++n) {
    sessions.push_back(RawSession::open(server.request_port()));
    RawConnection& requests = sessions.back().requests;
    for (std::uint32_t id = 1; id <= kLists; ++id) requests.send(proto::encode(proto::GetMeshList{id}));
    requests.send(proto::encode(proto::Ping{9}));
    ASSERT_EQ(expect<proto::Pong>(requests).id, 9U);
  }
  const json clients = json::parse(admin.answer(proto::encode(proto::AdminClients{1})))["clients"];
  ASSERT_EQ(clients.size(), kSessions + 1);
  const auto explain = [&](std::size_t client) {
    return json::parse(admin.answer(proto::encode(proto::AdminExplain{2, clients[client]["client"]})));
  };

  const json last = explain(kSessions);
  EXPECT_EQ(last["waiting"], kLists * kSessions);
  EXPECT_EQ(last["more"], kLists * kSessions + 1 - 1'000 - kLists);
  const json& requests = last["requests"];
  ASSERT_EQ(requests.size(), 1'000 + kLists);
  for (std::size_t rank = 0; rank < 1'000; ++rank) ASSERT_EQ(requests[rank]["rank"], rank);
  for (std::size_t n = 0; n < kLists; ++n) {
    EXPECT_EQ(requests[1'000 + n]["rank"], kLists * (kSessions - 1) + 1 + n);
    EXPECT_EQ(requests[1'000 + n]["mine"], true);
  }
  EXPECT_EQ(last["summary"].get<std::string>().substr(0, 43), "waits for the mesh list behind 1032 others:");
  const json head = explain(1);
  EXPECT_EQ(head["requests"].size(), 1'000U) << "its own are among the first";
  EXPECT_EQ(head["more"], kLists * kSessions + 1 - 1'000);
  EXPECT_TRUE(head["next"]);
}

/// A page of the list goes through the same queue as packets, and the rules see how long it is.
TEST(RuleSwitch, AMeshListCountsAsItsPage) {
  scheduler::Policy policy;
  policy.rule = "spf";
  ServerInThread server({}, policy);
  auto admin = RawAdmin::open(server.admin_socket());
  ASSERT_EQ(admin.ingest("big", fake_mesh(1, {3'000'000, 100})), "ok");
  for (int n = 10; n < 40; ++n) ASSERT_EQ(admin.ingest("small" + std::to_string(n), fake_mesh(2, {700})), "ok");
  auto lister = RawSession::open(server.request_port());
  lister.requests.send(proto::encode(proto::GetMeshList{1}));
  const std::size_t page = lister.next_transfer().bytes.size();
  ASSERT_GT(page, 31 * 80U);
  auto stuck = RawSession::open(server.request_port(), 4'096);
  stuck.open_mesh(1, "big");
  ASSERT_TRUE(stuck.data.stirs(kPatience));
  lister.requests.send(proto::encode(proto::GetMeshList{2}));
  lister.requests.send(proto::encode(proto::GetMeshList{3, "", "", 2}));
  auto fetcher = RawSession::open(server.request_port());
  fetcher.open_mesh(1, "small10");

  json queue;
  for (int tries = 0; tries < 200; ++tries) {
    queue = json::parse(admin.answer(proto::encode(proto::AdminQueue{3})));
    if (queue["waiting"] == 3) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const json& shown = queue["requests"];
  ASSERT_EQ(shown.size(), 4U);
  EXPECT_EQ(shown[1]["mesh"], "") << "two meshes of the list are shorter than the packet";
  EXPECT_EQ(shown[1]["bytes"], 12 + (page - 12) * 2 / 31);
  EXPECT_EQ(shown[2]["mesh"], "small10");
  EXPECT_EQ(shown[3]["mesh"], "") << "the whole list is longer than it";
  EXPECT_EQ(shown[3]["bytes"], page);
}

/// With a quantum a client that takes nothing loses its turn long before it is dropped.
TEST(RuleSwitch, AQuantumPassesByAClientThatTakesNothing) {
  net::Limits limits;
  limits.stall = std::chrono::seconds(30);
  scheduler::Policy policy;
  policy.quantum = std::chrono::milliseconds(100);
  ServerInThread server(limits, policy);
  auto admin = RawAdmin::open(server.admin_socket());
  const FakeMesh small = fake_mesh(2, {700, 100});
  ASSERT_EQ(admin.ingest("big", fake_mesh(1, {3'000'000, 100})), "ok");
  ASSERT_EQ(admin.ingest("small", small), "ok");
  auto stuck = RawSession::open(server.request_port(), 4'096);
  stuck.open_mesh(1, "big");
  ASSERT_TRUE(stuck.data.stirs(kPatience));
  auto other = RawSession::open(server.request_port());
  const auto asked = Clock::now();
  EXPECT_EQ(other.fetch("small"), small.packets);
  EXPECT_LT(Clock::now() - asked, std::chrono::seconds(5));
  const json queue = json::parse(admin.answer(proto::encode(proto::AdminQueue{3})));
  ASSERT_EQ(queue["requests"].size(), 1U);
  EXPECT_EQ(queue["requests"][0]["state"], "blocked");
  // Once it reads again, it gets all of it, from where it was.
  const RawTransfer transfer = stuck.next_transfer();
  EXPECT_EQ(transfer.result, proto::TransferResult::complete);
  EXPECT_EQ(transfer.bytes, fake_mesh(1, {3'000'000, 100}).packets[0]);
}

}  // namespace
}  // namespace pmcd::test
