// SPDX-License-Identifier: MIT
// pmcsim paper: the experiments that the paper compares its rules with, in its mode and in ours.
#include <algorithm>
#include <memory>
#include <utility>

#include "sim/arguments.h"
#include "sim/commands.h"
#include "sim/policies.h"

namespace pmcd::sim {
namespace {

struct PaperArguments {
  Arguments common;
  int experiment = 1;
  std::string mode = "paper";
};

int paper(const PaperArguments& arguments) {
  const bool ours = arguments.mode == "ours";
  std::vector<std::string> options = arguments.common.options;
  const auto unless_given = [&options](const std::string& name, const std::string& value) {
    const auto is_it = [&name](const std::string& option) { return option.rfind(name + "=", 0) == 0; };
    if (std::none_of(options.begin(), options.end(), is_it)) options.push_back(name + "=" + value);
  };
  unless_given("slots", ours ? "auto" : "1");
  unless_given("quantum", ours ? "250" : "0");
  auto policies = read_policies(arguments.common.rules, options);
  if (const Problem* problem = problem_of(policies)) return refuse(*problem);
  auto made = scenario_of(arguments.common);
  if (const Problem* problem = problem_of(made)) return refuse(*problem);
  Scenario scenario = std::get<Scenario>(std::move(made));
  if (scenario.lines.size() != 3) {
    return refuse(
        wrong_usage("--line is given " + std::to_string(scenario.lines.size()) +
                    " times; an experiment has three kinds of lines: of client 1, of client 2, of the others"));
  }
  scenario.open = ours ? 4 : 1;
  scenario.clients = paper_clients(scenario, arguments.experiment, arguments.common.seed, arguments.common.scale);
  const auto runs = simulate_all(scenario, std::get<std::vector<scheduler::Policy>>(policies));
  const std::string title = "Experiment " + std::to_string(arguments.experiment) + ", mode " + arguments.mode;
  return write_results(arguments.common, title, scenario, runs, true);
}

}  // namespace

void add_paper(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("paper", "Simulate an experiment of the paper");
  const auto arguments = std::make_shared<PaperArguments>();
  arguments->common.rules = {"all"};
  add_arguments(*command, arguments->common);
  command
      ->add_option("--experiment", arguments->experiment,
                   "1: three speeds, the same mesh; 2: three speeds, three meshes; 3: the same speed, three meshes; "
                   "4: twenty clients that arrive at random, one of which stalls")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  command
      ->add_option("--mode", arguments->mode,
                   "paper: slots=1, no quantum, one open request; ours: slots=auto, quantum=250, four open requests")
      ->check(CLI::IsMember({"paper", "ours"}))
      ->capture_default_str();
  command->footer(
      "The uplink carries 256 kbit/s; client 1 is behind 33.6, client 2 behind 1024/256, the others behind 2048/384 "
      "kbit/s.\n"
      "Examples:\n"
      "  pmcsim paper --experiment 1 --rules fifo,lcfs,spf,fcsf\n"
      "  pmcsim paper --experiment 4 --mode ours --meshes shown.json --json times.json --chart times.svg\n\n" +
      std::string(kExitStatus));
  command->callback([arguments, &exit_code] { exit_code = paper(*arguments); });
}

}  // namespace pmcd::sim
