// SPDX-License-Identifier: MIT
// Statistics by hand, and what tables, JSON and chart say of an outcome that is written here.
#include "sim/report.h"

#include <gtest/gtest.h>

#include <sstream>

#include "sim/chart.h"
#include "tests/sim/support.h"

namespace pmcd::sim {
namespace {

TEST(Statistics, quantiles_are_values_that_were_there) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Distribution d = distribution_of(values);
  EXPECT_EQ(d.count, 100U);
  EXPECT_DOUBLE_EQ(d.mean, 50.5);
  EXPECT_EQ(d.median, 50);
  EXPECT_EQ(d.p95, 95);
  EXPECT_EQ(d.p99, 99);
  EXPECT_EQ(distribution_of({7}).p99, 7);
  EXPECT_EQ(distribution_of({}).mean, kNever);
}

TEST(Statistics, fairness) {
  EXPECT_DOUBLE_EQ(jain_index({2, 2, 2}), 1);
  EXPECT_DOUBLE_EQ(jain_index({1, 0, 0, 0}), 0.25);
  EXPECT_DOUBLE_EQ(jain_index({1, 3}), 16.0 / 20);
  EXPECT_DOUBLE_EQ(jain_index({}), 1);
}

class Reports : public testing::Test {
 protected:
  Reports() {
    scenario_.clients = {{0, 0, {0}, false}, {1, 2, {1}, true}};
    Outcome outcome;
    outcome.fetches.resize(2);
    outcome.fetches[0] = {0, 0, true, 0, 0.5, {1, 2, 3}, 40};
    outcome.fetches[1] = {1, 1, true, 1, 0.25, {1.5, kNever, kNever}, kNever};
    outcome.link_use = 0.5;
    outcome.dropped = 1;
    runs_ = {{policy("fifo"), outcome}, {policy("fcsf", {"burst=2"}), outcome}};
  }
  Scenario scenario_ = paper_scenario();
  std::vector<sim::Run> runs_;
};

TEST_F(Reports, heading_tells_the_link_from_what_the_daemon_is_told) {
  scenario_.uplink_kbit = 1024.5;
  std::ostringstream out;
  print_heading(out, "t", scenario_);
  EXPECT_EQ(out.str(),
            "t; the server's link carries 1024.5 kbit/s\n"
            "(uplink= in a policy is not that, but what the daemon is told of it; 0: it measures)\n"
            "\n");
}

TEST_F(Reports, client_table) {
  std::ostringstream out;
  print_clients(out, scenario_, runs_[0]);
  EXPECT_EQ(out.str(),
            "fifo aging=0 quantum=0 slots=1 uplink=0\n"
            "client      line      mesh   begins  packet 0  10 % error  5 % error  1 % error  complete\n"
            "1           modem     horse   0.000     0.500       1.000      2.000      3.000    40.000\n"
            "2 (stalls)  fast-dsl  bunny   1.000     0.250       1.500          -          -         -\n"
            "\n");
}

TEST_F(Reports, summary_table) {
  std::ostringstream out;
  print_summaries(out, scenario_, {runs_[0]});
  EXPECT_EQ(out.str(),
            "policy                                   time to        mean  median     p95     p99  count\n"
            "fifo aging=0 quantum=0 slots=1 uplink=0  first level   0.375   0.250   0.500   0.500      2\n"
            "                                         10 % error    1.250   1.000   1.500   1.500      2\n"
            "                                         complete     40.000  40.000  40.000  40.000      1\n"
            "\n"
            "policy                                   fairness  link use  complete  dropped  simulated s\n"
            "fifo aging=0 quantum=0 slots=1 uplink=0     1.000    50.0 %    1 of 2        1          0.0\n");
}

TEST_F(Reports, json) {
  const std::string text = json_of("t", scenario_, runs_, true);
  EXPECT_NE(text.find("\"complete\": null"), std::string::npos);
  EXPECT_NE(text.find("\"policy\": \"fcsf aging=0 burst=2 quantum=0 slots=1 uplink=0\""), std::string::npos);
  EXPECT_NE(text.find("\"to_10_percent\": 1.5"), std::string::npos);
  EXPECT_EQ(json_of("t", scenario_, runs_, false).find("\"stalls\""), std::string::npos);
  // Rules that differ in their own options only are told apart.
  EXPECT_NE(text.find("\"rule\": \"fifo\""), std::string::npos);
  EXPECT_NE(text.find("\"rule\": \"fcsf+burst=2\""), std::string::npos);
}

TEST_F(Reports, chart_has_a_curve_and_a_name_for_each_run) {
  const std::string svg = chart_of("a < b & c", runs_);
  EXPECT_EQ(svg.substr(0, 5), "<svg ");
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  std::size_t curves = 0;
  for (std::size_t at = 0; (at = svg.find("<polyline", at)) != std::string::npos; ++at) ++curves;
  EXPECT_EQ(curves, 2U);
  EXPECT_NE(svg.find(">fcsf aging=0 burst=2 quantum=0 slots=1 uplink=0<"), std::string::npos);
  // One of two was complete, at the end of the axis: the curve rises to the middle of the plot there.
  EXPECT_NE(svg.find("620.0,370.0 620.0,210.0"), std::string::npos);
}

}  // namespace
}  // namespace pmcd::sim
