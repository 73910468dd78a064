// SPDX-License-Identifier: GPL-3.0-or-later
// Queue, clients, explanations and weights: documents as the contract has them, to exact lines.
#include "admin-cli/queue_text.h"

#include <gtest/gtest.h>

namespace pmcd::admin {
namespace {

ordered_json queue() {
  return ordered_json::parse(R"({"rule":"fifo","text":"fifo slots=1","waiting":1200,"running":1,"requests":[
    {"rank":0,"state":"running","client":7,"address":"10.0.0.7:5","mesh":"bunny","packet":3,"bytes_left":1000,
     "bytes":34100,"asked_seconds_ago":2.5,"queued_seconds_ago":2.5,"reason":"running"},
    {"rank":1,"state":"waiting","client":12,"address":"10.0.0.9:5","mesh":"cow","packet":0,"bytes_left":812,
     "bytes":812,"asked_seconds_ago":75,"queued_seconds_ago":0.25,"reason":"waits for 0.25 s"}],"more":1199})");
}

TEST(QueueText, Queue) {
  const Lines expected{"rule: fifo slots=1",
                       "1200 waiting, 1 running",
                       "",
                       "rank  state    client  mesh   packet     left   asked  queued  reason",
                       "   0  running       7  bunny       3  1.00 kB  2.50 s  2.50 s  running",
                       "   1  waiting      12  cow         0    812 B  75.0 s  0.25 s  waits for 0.25 s",
                       "... and 1199 more"};
  EXPECT_EQ(queue_lines(queue()), expected);
}

TEST(QueueText, AnEmptyQueue) {
  EXPECT_EQ(queue_lines({{"text", "fifo"}, {"waiting", 0}, {"running", 0}, {"requests", ordered_json::array()}}),
            (Lines{"rule: fifo", "0 waiting, 0 running"}));
}

TEST(QueueText, Clients) {
  const auto document = ordered_json::parse(R"({"uplink_kbit":5000,"clients":[
    {"client":7,"address":"10.0.0.7:5","speed_kbit":33.6,"taking_kbit":12,"weight":2.5,"bytes":34100,"share":0.25,
     "mesh":"bunny","level":3,"levels":12,"waiting":0,"running":1,"connected_seconds":75},
    {"client":12,"address":"10.0.0.9:5","speed_kbit":null,"taking_kbit":0,"weight":1,"bytes":0,"share":0,
     "mesh":null,"level":null,"levels":null,"waiting":1,"running":0,"connected_seconds":7500}]})");
  const Lines expected{
      "client  address           speed       taking  weight    bytes   share  level  waiting  running  connected  "
      "mesh",
      "     7  10.0.0.7:5  33.6 kbit/s  12.0 kbit/s     2.5  34.1 kB  25.0 %   3/12        0        1     75.0 s  "
      "bunny",
      "    12  10.0.0.9:5            -     0 kbit/s       1      0 B   0.0 %      -        1        0  2 h 5 min  -",
      "", "uplink: 5.00 Mbit/s"};
  EXPECT_EQ(clients_lines(document), expected);
  EXPECT_EQ(clients_lines({{"uplink_kbit", nullptr}}).back(), "uplink: not known yet");
}

TEST(QueueText, AnExplanationMarksWhatIsTheClients) {
  ordered_json document = queue();
  document["client"] = 12;
  document["address"] = "10.0.0.9:5";
  document["next"] = true;
  document["summary"] = "is next";
  document["requests"][1]["mine"] = true;
  const Lines expected{"client 12 (10.0.0.9:5): is next",
                       "rule: fifo slots=1",
                       "1200 waiting, 1 running",
                       "",
                       "   rank  state    client  mesh   packet     left   asked  queued  reason",
                       "      0  running       7  bunny       3  1.00 kB  2.50 s  2.50 s  running",
                       "*     1  waiting      12  cow         0    812 B  75.0 s  0.25 s  waits for 0.25 s",
                       "... and 1199 more"};
  EXPECT_EQ(explain_lines(document), expected);
  document["requests"] = ordered_json::array();
  EXPECT_EQ(explain_lines(document),
            (Lines{"client 12 (10.0.0.9:5): is next", "rule: fifo slots=1", "1200 waiting, 1 running"}));
}

TEST(QueueText, AGapInTheOrderIsShownAndAListIsNoMesh) {
  ordered_json document = queue();
  document["requests"][1]["rank"] = 1'100;
  document["requests"][1]["mesh"] = "";
  const Lines expected{"rule: fifo slots=1",
                       "1200 waiting, 1 running",
                       "",
                       "rank  state    client  mesh         packet     left   asked  queued  reason",
                       "   0  running       7  bunny             3  1.00 kB  2.50 s  2.50 s  running",
                       " ...",
                       "1100  waiting      12  (mesh list)       -    812 B  75.0 s  0.25 s  waits for 0.25 s",
                       "... and 1199 more"};
  EXPECT_EQ(queue_lines(document), expected);
}

TEST(QueueText, Weight) {
  EXPECT_EQ(weight_line({{"client", 7}, {"weight", 2.5}, {"before", 1}}), "client 7: weight 1 -> 2.5");
  EXPECT_EQ(weight_line({{"client", 7}, {"weight", 12345.678}, {"before", 1}, {"rule", "fair"}, {"counts", true}}),
            "client 7: weight 1 -> 12345.678");
  EXPECT_EQ(weight_line({{"client", 7}, {"weight", 2}, {"before", 1}, {"rule", "gain"}, {"counts", false}}),
            "client 7: weight 1 -> 2 (does not count now: the rule gain goes by no weights)");
}

}  // namespace
}  // namespace pmcd::admin
