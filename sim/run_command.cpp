// SPDX-License-Identifier: MIT
// pmcsim run: a crowd of clients on lines of several kinds.
#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <utility>

#include "sim/arguments.h"
#include "sim/commands.h"
#include "sim/plan.h"
#include "sim/policies.h"

namespace pmcd::sim {
namespace {

struct RunArguments {
  Arguments common;
  std::string arrivals = "poisson:1";
  std::size_t clients = 100;
  std::size_t meshes_each = 1;
  unsigned open = 4;
  double stall = 0;
  std::string plan;
  std::vector<PlanOption> beside_plan;  ///< those that were given
  bool each = false;
};

/// What a plan may leave to the command line.
constexpr auto kBesidePlan =
    std::to_array<PlanOption>({{"--uplink", "uplink_kbit"}, {"--open", "open"}, {"--meshes", "meshes"}});

int run(const RunArguments& arguments) {
  auto policies = read_policies(arguments.common.rules, arguments.common.options);
  if (const Problem* problem = problem_of(policies)) return refuse(*problem);
  auto arrivals = parse_arrivals(arguments.arrivals);
  if (const Problem* problem = problem_of(arrivals)) return refuse(*problem);
  auto made = scenario_of(arguments.common);
  if (const Problem* problem = problem_of(made)) return refuse(*problem);
  Scenario scenario = std::get<Scenario>(std::move(made));
  scenario.open = arguments.open;
  if (!arguments.plan.empty()) {
    auto planned = read_plan(arguments.plan, std::move(scenario), arguments.beside_plan);
    if (const Problem* problem = problem_of(planned)) return refuse(*problem);
    scenario = std::get<Scenario>(std::move(planned));
    return write_results(arguments.common, arguments.plan, scenario,
                         simulate_all(scenario, std::get<std::vector<scheduler::Policy>>(policies)), arguments.each);
  }
  scenario.clients = draw_clients(scenario, {arguments.clients, std::get<ArrivalProcess>(arrivals),
                                             arguments.meshes_each, arguments.stall, arguments.common.seed});
  const auto runs = simulate_all(scenario, std::get<std::vector<scheduler::Policy>>(policies));
  const std::string title = std::to_string(arguments.clients) + " clients, arrivals " + arguments.arrivals + ", seed " +
                            std::to_string(arguments.common.seed);
  return write_results(arguments.common, title, scenario, runs, arguments.each);
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("run", "Simulate a crowd of clients");
  const auto arguments = std::make_shared<RunArguments>();
  arguments->common.rules = {"fifo"};
  add_arguments(*command, arguments->common);
  command->add_option("--clients", arguments->clients, "How many come")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  command->add_option("--arrivals", arguments->arrivals, "at-once, every:SECONDS or poisson:CLIENTS_A_SECOND")
      ->capture_default_str();
  command->add_option("--meshes-each", arguments->meshes_each, "Meshes that each client fetches, one after the other")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  command->add_option("--open", arguments->open, "Requests that a client keeps open")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command->add_option("--stall", arguments->stall, "Share of the clients that stop reading in the middle of a mesh")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  CLI::Option* plan = command->add_option(
      "--plan", arguments->plan,
      "JSON file that says which clients come when, over which lines, and what they fetch: sim/README.md describes it; "
      "--uplink, --open and --meshes count where it does not say that, too");
  for (const char* drawn : {"--clients", "--arrivals", "--meshes-each", "--stall", "--line", "--scale"}) {
    plan->excludes(command->get_option(drawn));
  }
  command->add_flag("--each", arguments->each, "Also print each client's times");
  command->footer(
      "Examples:\n"
      "  pmcsim run --rule fcsf --option burst=2 --option quantum=500 --option slots=auto --uplink 1024\n"
      "  pmcsim run --rules all --option slots=auto --clients 500 --arrivals poisson:0.5 --chart rules.svg\n"
      "  pmcsim run --rules fifo,gain,gain+until=5 --option slots=auto\n"
      "  pmcsim run --rule srpt --line phone=8000/2000/60:3 --line fibre=100000/40000/8 --uplink 50000 --json -\n"
      "  pmcsim run --rule gain --option slots=auto --plan plan.json --network packets --each\n\n" +
      std::string(kExitStatus));
  command->callback([arguments, command, &exit_code] {
    std::copy_if(kBesidePlan.begin(), kBesidePlan.end(), std::back_inserter(arguments->beside_plan),
                 [command](const PlanOption& one) { return command->count(one.option) > 0; });
    exit_code = run(*arguments);
  });
}

}  // namespace pmcd::sim
