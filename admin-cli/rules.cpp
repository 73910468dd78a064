// SPDX-License-Identifier: GPL-3.0-or-later
// The commands about the distribution rule: rules, rule, set-rule, history, revert.
#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "admin-cli/arguments.h"
#include "admin-cli/checks.h"
#include "admin-cli/commands.h"
#include "admin-cli/conversation.h"
#include "admin-cli/rule_text.h"
#include "proto/admin_rules.h"

namespace pmcd::admin {

namespace {

constexpr std::size_t kMaxRuleBytes = 255;  ///< of a str8

constexpr const char* kSetRuleFooter =
    "Examples:\n"
    "  pmcctl set-rule fcsf --option burst=2 --option quantum=500\n"
    "  pmcctl set-rule gain --option slots=auto --dry-run\n"
    "  pmcctl set-rule --keep --option uplink=19000\n"
    "  pmcctl set-rule fifo --if-version 3";

struct Change {
  proto::ChangeTerms terms;
  std::string rule;
  std::vector<std::string> options;
  bool keep = false;
  std::uint64_t number = 0;
};

void add_terms(CLI::App& sub, Change& change) {
  sub.add_flag("--dry-run", change.terms.dry_run, "Say what would change, and change nothing");
  sub.add_option("--if-version", change.terms.if_version, "Only while the rule's version is this one")
      ->check(is_number())
      ->type_name("V");
}

void print_change(const ordered_json& document) {
  for (const std::string& warning : change_warnings(document)) std::cerr << "pmcctl: warning: " << warning << '\n';
  std::cout << change_line(document) << '\n';
}

/// What is wrong with an option, for the command line; empty if nothing.
std::string option_complaint(const std::string& text) {
  return parse_option(text) ? "" : "\"" + text + "\" is not NAME=VALUE of at most 255 bytes each";
}

/// Adds what `request` does not name and `present`, the answer to `rule`, has: the rule, its own options if it stays
/// the same, and those of every rule that were set live; what comes from the configuration goes on coming from there.
/// And that nothing may change in between.
void keep_rest(const ordered_json& present, proto::AdminSetRule& request) {
  const auto text_of = [](const ordered_json& value) { return value.is_string() ? value.get<std::string>() : ""; };
  const std::string rule = text_of(present.value("rule", ordered_json()));
  if (request.rule.empty()) request.rule = rule;
  const ordered_json sources = object_of(present, "sources");
  const ordered_json options = object_of(present, "options");
  for (const auto& [name, value] : options.items()) {
    const bool kept = sources.contains(name) ? sources[name] == "live change" : request.rule == rule;
    const bool given = std::any_of(request.options.begin(), request.options.end(),
                                   [&name = name](const proto::RuleOptionText& option) { return option.name == name; });
    if (kept && !given) request.options.push_back({name, text_of(value)});
  }
  if (!request.terms.if_version) request.terms.if_version = count_of(present, "version");
}

int set_rule(const Common& common, const Change& change) {
  proto::AdminSetRule request{0, change.terms, change.rule, {}};
  for (const std::string& text : change.options) {
    if (auto option = parse_option(text)) request.options.push_back(std::move(*option));
  }
  const auto& options = request.options;
  for (std::size_t i = 0; i < options.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (options[i].name != options[j].name) continue;
      return report(common, "set-rule",
                    {kUsage, proto::ErrorCode::none, "option " + options[i].name + " is given twice"});
    }
  }
  if (options.size() > proto::kMaxRuleOptions) {
    return report(common, "set-rule", {kUsage, proto::ErrorCode::none, "more than 64 options"});
  }
  const bool is_named = !change.rule.empty();
  if (!is_named && !change.keep) {
    return report(common, "set-rule", {kUsage, proto::ErrorCode::bad_rule, "rule is required, or --keep"});
  }
  if (change.rule.size() > kMaxRuleBytes) {
    return report(common, "set-rule",
                  {kUsage, proto::ErrorCode::bad_rule, "this is no name of a rule; pmcctl rules lists them"});
  }
  if (!change.keep) return run(common, "set-rule", std::move(request), print_change);

  auto opened = Conversation::open(common.socket);
  if (const auto* failed = std::get_if<Failure>(&opened)) return report(common, "set-rule", *failed);
  auto& conversation = std::get<Conversation>(opened);
  const auto present = conversation.ask(proto::AdminRule{});
  if (const auto* failed = std::get_if<Failure>(&present)) return report(common, "set-rule", *failed);
  keep_rest(std::get<ordered_json>(present), request);
  return show_answer(common, "set-rule", conversation.ask(std::move(request)), print_change);
}

}  // namespace

void add_rules(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("rules", "List the distribution rules and their options");
  sub->callback([&common, &exit_code] {
    exit_code = run(common, "rules", proto::AdminRules{},
                    [](const ordered_json& document) { print_lines(rules_lines(document)); });
  });
}

void add_rule(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub =
      app.add_subcommand("rule", "Show the active rule, since when, by whom, and where its values come from");
  sub->callback([&common, &exit_code] {
    exit_code = run(common, "rule", proto::AdminRule{},
                    [](const ordered_json& document) { print_lines(rule_lines(document)); });
  });
}

void add_set_rule(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("set-rule", "Change the rule, at once and for good");
  const auto change = std::make_shared<Change>();
  sub->add_option("rule", change->rule, "Name of the rule; with --keep, the present one if it is left out");
  // One value each: else the options would swallow the name of a rule that stands behind them.
  sub->add_option("--option", change->options, "An option of the rule; may be given more than once")
      ->allow_extra_args(false)
      ->check(CLI::Validator(option_complaint, "", "name and value"))
      ->type_name("NAME=VALUE");
  sub->add_flag("--keep", change->keep,
                "Keep what is not named: options of the rule, if it stays the same, and what was last set live");
  add_terms(*sub, *change);
  sub->footer(kSetRuleFooter);
  sub->callback([change, &common, &exit_code] { exit_code = set_rule(common, *change); });
}

void add_history(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("history", "Show past changes of the rule, the newest first");
  const auto most = std::make_shared<std::uint32_t>(0);
  sub->add_option("--most", *most, "Show at most this many; 0: all")->check(is_number(UINT32_MAX))->type_name("N");
  sub->callback([most, &common, &exit_code] {
    exit_code = run(common, "history", proto::AdminHistory{0, *most},
                    [](const ordered_json& document) { print_lines(history_lines(document)); });
  });
}

void add_revert(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("revert", "Go back to the rule of a past change");
  const auto change = std::make_shared<Change>();
  sub->add_option("number", change->number, "The change, as in pmcctl history; 0: what the configuration says")
      ->required()
      ->check(is_number())
      ->type_name("N");
  add_terms(*sub, *change);
  sub->callback([change, &common, &exit_code] {
    exit_code = run(common, "revert", proto::AdminRevert{0, change->terms, change->number}, print_change);
  });
}

}  // namespace pmcd::admin
