// SPDX-License-Identifier: GPL-3.0-or-later
// The commands about who waits and who is served: queue, clients, explain, weight.
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>

#include "admin-cli/arguments.h"
#include "admin-cli/checks.h"
#include "admin-cli/commands.h"
#include "admin-cli/conversation.h"
#include "admin-cli/queue_text.h"
#include "proto/admin_rules.h"

namespace pmcd::admin {

namespace {

constexpr const char* kClientHelp = "Number of the client, as in pmcctl clients";

/// What is wrong with a weight, for the command line; empty if nothing.
std::string weight_complaint(const std::string& text) {
  return parse_weight(text) ? "" : "\"" + text + "\" is no number from 0.001 to 1000000 with at most three decimals";
}

}  // namespace

void add_queue(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("queue", "Show the requests that run and wait, in the order in which they go");
  sub->callback([&common, &exit_code] {
    exit_code = run(common, "queue", proto::AdminQueue{},
                    [](const ordered_json& document) { print_lines(queue_lines(document)); });
  });
}

void add_clients(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("clients", "Show the clients: speed, weight, bytes, share and level");
  sub->callback([&common, &exit_code] {
    exit_code = run(common, "clients", proto::AdminClients{},
                    [](const ordered_json& document) { print_lines(clients_lines(document)); });
  });
}

void add_explain(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("explain", "Say why a client is next, or why it is not");
  const auto client = std::make_shared<std::uint64_t>(0);
  sub->add_option("client", *client, kClientHelp)->required()->check(is_number())->type_name("CLIENT");
  sub->callback([client, &common, &exit_code] {
    exit_code = run(common, "explain", proto::AdminExplain{0, *client},
                    [](const ordered_json& document) { print_lines(explain_lines(document)); });
  });
}

void add_weight(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("weight", "Give a client more or less than the others, until it leaves");
  const auto client = std::make_shared<std::uint64_t>(0);
  const auto weight = std::make_shared<std::string>();
  sub->add_option("client", *client, kClientHelp)->required()->check(is_number())->type_name("CLIENT");
  sub->add_option("weight", *weight, "0.001 to 1000000; a client that was given none has 1")
      ->required()
      ->check(CLI::Validator(weight_complaint, "", "weight"));
  sub->callback([client, weight, &common, &exit_code] {
    const std::uint32_t thousandths = parse_weight(*weight).value_or(proto::kWeightOne);
    exit_code = run(common, "weight", proto::AdminWeight{0, *client, thousandths},
                    [](const ordered_json& document) { std::cout << weight_line(document) << '\n'; });
  });
}

}  // namespace pmcd::admin
