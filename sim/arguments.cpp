// SPDX-License-Identifier: MIT
// Ranges are checked where the command line is read; a file's contents where it is read.
#include "sim/arguments.h"

#include <fstream>
#include <iostream>
#include <sstream>
#include <utility>

#include "sim/chart.h"
#include "sim/commands.h"

namespace pmcd::sim {
namespace {

bool write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (file) return true;
  std::cerr << "pmcsim: " << path << ": cannot be written\n";
  return false;
}

}  // namespace

void add_arguments(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--rule,--rules", arguments.rules,
                  "Distribution rules, by comma, or all; RULE+NAME=VALUE gives an option to that rule alone, as "
                  "bench/rules/run takes it: gain,gain+until=5")
      ->delimiter(',')
      ->capture_default_str();
  command
      .add_option("--option", arguments.options,
                  "NAME=VALUE: slots, quantum, aging or uplink (what the daemon is told that its link carries), or an "
                  "option of a rule, as the daemon takes them")
      ->allow_extra_args(false);
  command
      .add_option(
          "--line", arguments.lines,
          "NAME=DOWN/UP/RTT_MS[:WEIGHT], kbit/s and milliseconds: a kind of connection, and how often it is drawn; "
          "may be given several times; default: the paper's, 33.6, 1024/256 and 2048/384 kbit/s at 150, 50, 40 ms")
      ->allow_extra_args(false);
  command.add_option(
      "--meshes", arguments.meshes,
      "File with what pmcctl --json prints of show (or several in an array) or list, or a table with the "
      "header name,level,bytes,vertices,error; default: ten meshes that are made up");
  command
      .add_option(
          "--network", arguments.network,
          "fluid: clients share the uplink as a flow, for very large crowds; packets: each segment goes through "
          "the queues by itself, with TCP as Linux does it, which is truer and much dearer")
      ->check(CLI::IsMember({"fluid", "packets"}))
      ->capture_default_str();
  command
      .add_option("--uplink", arguments.uplink,
                  "What the server's link carries, kbit/s; the daemon has to measure it unless it is told with "
                  "--option uplink=KBIT")
      ->check(CLI::Range(0.1, 1e9))
      ->capture_default_str();
  command.add_option("--scale", arguments.scale, "Multiplies all speeds")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  command
      .add_option("--setup", arguments.setup_round_trips,
                  "fluid: round trips from connecting until the first request has come")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command.add_option("--decode", arguments.decode_rate, "kB of packets that a client decodes in a second; 0: no time")
      ->check(CLI::Range(0.0, 1e9))
      ->capture_default_str();
  command.add_option("--queue-ms", arguments.queue_ms, "What queues before a bottleneck, in milliseconds of its speed")
      ->check(CLI::Range(0.0, 60'000.0))
      ->capture_default_str();
  command.add_option("--queue-packets", arguments.queue_packets, "... but so many packets of 1500 bytes at least")
      ->check(CLI::Range(1.0, 100'000.0))
      ->capture_default_str();
  command
      .add_option("--look-ms", arguments.look_ms,
                  "fluid: how often the daemon looks at what is acknowledged; 0: once a chunk, which is cheaper")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      .add_option(
          "--late-ms", arguments.late_ms,
          "packets: how late a process wakes up on average, drawn from the seed: what comes out differently with "
          "another seed hangs on chance")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      .add_option("--chunk-ms", arguments.chunk_ms,
                  "How much of a client's speed a chunk is: 100 as in the daemon; more are cheaper to simulate")
      ->check(CLI::Range(1.0, 10'000.0))
      ->capture_default_str();
  command.add_option("--seed", arguments.seed, "The same seed gives the same bytes")->capture_default_str();
  command.add_option("--json", arguments.json, "Write JSON to this file, or to standard output (-)");
  command.add_option("--chart", arguments.chart, "Draw which part was complete after how long, as SVG, to this file");
}

Result<Scenario> scenario_of(const Arguments& arguments) {
  Scenario scenario;
  scenario.network = arguments.network == "packets" ? Network::packets : Network::fluid;
  if (scenario.network == Network::fluid && arguments.late_ms != 0) {
    std::ostringstream text;
    text << "--late-ms " << arguments.late_ms << ": processes wake up late with --network packets only, not with fluid";
    return wrong_usage(text.str());
  }
  for (const std::string& text : arguments.lines) {
    auto line = parse_line(text);
    if (const Problem* problem = problem_of(line)) return *problem;
    scenario.lines.push_back(std::get<Line>(std::move(line)));
  }
  if (scenario.lines.empty()) scenario.lines = paper_lines();
  if (arguments.meshes.empty()) {
    scenario.meshes = built_in_meshes();
  } else {
    auto meshes = read_meshes(arguments.meshes);
    if (const Problem* problem = problem_of(meshes)) return *problem;
    scenario.meshes = std::get<std::vector<Mesh>>(std::move(meshes));
  }
  scenario.uplink_kbit = arguments.uplink;
  scenario.setup_round_trips = arguments.setup_round_trips;
  scenario.decode_rate = arguments.decode_rate * 1000;
  scenario.tcp.queue_seconds = arguments.queue_ms / 1000;
  scenario.tcp.queue_bytes = arguments.queue_packets * 1500;
  scenario.look_every = arguments.look_ms / 1000;
  scenario.lateness = arguments.late_ms / 1000;
  scenario.seed = arguments.seed;
  scenario.chunk_seconds = arguments.chunk_ms / 1000;
  scale_speeds(scenario, arguments.scale);
  return scenario;
}

std::vector<Run> simulate_all(const Scenario& scenario, const std::vector<scheduler::Policy>& policies) {
  std::vector<Run> runs;
  runs.reserve(policies.size());
  for (const scheduler::Policy& policy : policies) runs.push_back({policy, simulate(scenario, policy)});
  return runs;
}

int write_results(const Arguments& arguments, const std::string& title, const Scenario& scenario,
                  const std::vector<Run>& runs, bool clients) {
  if (!arguments.chart.empty() && !write_file(arguments.chart, chart_of(whole_title(title, scenario), runs))) {
    return kBadInput;
  }
  if (arguments.json == "-") {
    std::cout << json_of(title, scenario, runs, clients);
    return kDone;
  }
  if (!arguments.json.empty() && !write_file(arguments.json, json_of(title, scenario, runs, clients))) return kBadInput;
  print_heading(std::cout, title, scenario);
  if (clients) {
    for (const Run& run : runs) print_clients(std::cout, scenario, run);
  }
  print_summaries(std::cout, scenario, runs);
  return kDone;
}

int refuse(const Problem& problem) {
  std::cerr << "pmcsim: " << problem.text << '\n';
  return problem.is_usage ? kUsage : kBadInput;
}

}  // namespace pmcd::sim
