// SPDX-License-Identifier: MIT
// Layers of policy, and the step from one to the next.
#include "daemon/net/policy_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "daemon/net/on_store.h"
#include "daemon/store/wall_clock.h"
#include "proto/text.h"

namespace pmcd::net {
namespace {

using scheduler::PolicyLayer;

/// What a row of the history says, or none if this daemon does not understand it.
std::optional<PolicyLayer> layer_of(const store::RuleChange& change) {
  auto options = scheduler::split_options(change.options);
  if (!change.rule || !options) return std::nullopt;
  PolicyLayer layer{change.rule, std::move(*options)};
  if (scheduler::check(layer)) return std::nullopt;
  return layer;
}

PolicyKeeper::Refusal refusal_of(const store::Error& error) {
  using proto::ErrorCode;
  const ErrorCode code = error.code == store::ErrorCode::version_changed  ? ErrorCode::version_changed
                         : error.code == store::ErrorCode::unknown_change ? ErrorCode::unknown_change
                                                                          : ErrorCode::storage_failed;
  return {code, error.detail};
}

}  // namespace

PolicyKeeper::PolicyKeeper(Executor executor, store::StoreThread& writer, PolicySources sources,
                           std::function<void(const scheduler::Policy&)> apply)
    : executor_(std::move(executor)),
      writer_(writer),
      command_line_(std::move(sources.command_line)),
      config_file_(std::move(sources.config_file)),
      apply_(std::move(apply)),
      started_at_(store::seconds_since_1970()),
      last_(std::move(sources.live.change)),
      version_(sources.live.version) {
  for (const store::DamagedChange& damaged : sources.live.damaged) {
    spdlog::warn("live change {} of the rule is damaged and is left out: {}", damaged.number,
                 proto::printable(damaged.error, proto::kMaxErrorTextBytes));
  }
  if (last_ && last_->rule) {
    live_ = layer_of(*last_);
    if (!live_) {
      spdlog::warn("the last live change of the rule, \"{} {}\", means nothing to this daemon and is left out",
                   proto::printable(*last_->rule, proto::kMaxErrorTextBytes),
                   proto::printable(last_->options, proto::kMaxErrorTextBytes));
    }
  }
  resolved_ = resolve(live_, When::now);
  if (!live_) return;
  const scheduler::Policy without = resolve(std::nullopt, When::now).policy;
  if (config_file_ == PolicyLayer{} || without == resolved_.policy) return;
  spdlog::info(
      "live change {} of the rule goes before the config file, which would make it \"{}\"; pmcctl revert 0 goes "
      "back to that",
      last_->number, scheduler::text_of(without));
}

scheduler::Resolved PolicyKeeper::resolve(const std::optional<PolicyLayer>& live, When when) const {
  const PolicyLayer middle = live.value_or(PolicyLayer{});
  if (when == When::now && changed_here_) return scheduler::resolve(std::array{middle, command_line_, config_file_});
  return scheduler::resolve(std::array{command_line_, middle, config_file_});
}

PolicyKeeper::Report PolicyKeeper::report() const {
  return report_of(resolved_, last_);
}

PolicyKeeper::Report PolicyKeeper::report_of(const scheduler::Resolved& resolved,
                                             const std::optional<store::RuleChange>& live) const {
  // The order of the layers, as resolve() puts them.
  const std::size_t live_index = changed_here_ ? 0 : 1;
  const auto name = [&](scheduler::Source source) -> std::string {
    if (!source) return "default";
    if (*source == live_index) return "live change";
    return *source == 2 ? "config file" : "command line";
  };
  Report report;
  report.policy = resolved.policy;
  report.version = std::max(version_, live ? live->number : 0);
  report.since = started_at_;
  report.rule_from = name(resolved.rule_from);
  for (const auto& [option, source] : resolved.from) report.from.emplace_back(option, name(source));
  const bool is_live =
      resolved.rule_from == live_index || std::any_of(resolved.from.begin(), resolved.from.end(),
                                                      [&](const auto& from) { return from.second == live_index; });
  if (live && (is_live || changed_here_)) {
    report.since = live->changed_at;
    report.by = PeerIdentity{static_cast<uid_t>(live->uid), static_cast<pid_t>(live->pid)};
  }
  return report;
}

std::vector<std::string> PolicyKeeper::warnings(const std::optional<PolicyLayer>& live) const {
  std::vector<std::string> warnings;
  if (!live) return warnings;
  const auto forget = [&](const std::string& flag, const std::string& value) {
    warnings.push_back("a restart will forget " + value + ": " + flag + " stands on the command line");
  };
  const scheduler::Policy now = scheduler::resolve(std::array{*live, command_line_, config_file_}).policy;
  const scheduler::Policy later = resolve(live, When::after_restart).policy;
  if (now.rule != later.rule || now.rule_options != later.rule_options) {
    std::string flags = "--rule " + *command_line_.rule;
    for (const auto& [name, value] : scheduler::all_options(later.rule, later.rule_options)) {
      if (command_line_.options.contains(name)) flags.append(" --rule-option ").append(name).append("=").append(value);
    }
    const std::string options = scheduler::join_options(scheduler::all_options(now.rule, now.rule_options));
    forget(flags, "rule " + now.rule + (options.empty() ? "" : " ") + options);
  }
  for (const scheduler::CommonOption& option : scheduler::common_options()) {
    const auto said = live->options.find(option.name);
    const auto pinned = command_line_.options.find(option.name);
    if (said == live->options.end() || pinned == command_line_.options.end() || pinned->second == said->second)
      continue;
    const scheduler::PolicyLayer one{std::nullopt, {*said}};
    forget("--" + pinned->first + ' ' + pinned->second, scheduler::join_options(one.options));
  }
  return warnings;
}

awaitable<std::variant<PolicyKeeper::Change, PolicyKeeper::Refusal>> PolicyKeeper::set(PolicyLayer layer,
                                                                                       proto::ChangeTerms terms,
                                                                                       PeerIdentity who) {
  if (const auto error = scheduler::check(layer)) {
    co_return Refusal{error->is_rule ? proto::ErrorCode::bad_rule : proto::ErrorCode::bad_option, error->sentence()};
  }
  std::optional<PolicyLayer> live = std::move(layer);
  const std::optional<std::int64_t> reverts;
  co_return co_await change(std::move(live), reverts, terms, who);
}

awaitable<std::variant<PolicyKeeper::Change, PolicyKeeper::Refusal>> PolicyKeeper::revert(std::uint64_t number,
                                                                                          proto::ChangeTerms terms,
                                                                                          PeerIdentity who) {
  const auto wanted = static_cast<std::int64_t>(std::min<std::uint64_t>(number, INT64_MAX));
  std::optional<PolicyLayer> layer;
  const std::optional<std::int64_t> reverts = wanted;
  if (number == 0) co_return co_await change(std::move(layer), reverts, terms, who);
  auto work = [wanted](store::MeshStore& store) { return store.rules().find(wanted); };
  const auto found = co_await on_store(executor_, writer_, std::move(work));
  if (!found) co_return refusal_of(found.error());
  if (found.value().rule) {
    layer = layer_of(found.value());
    if (!layer) {
      co_return Refusal{proto::ErrorCode::bad_rule, "change " + std::to_string(number) + ", \"" + *found.value().rule +
                                                        " " + found.value().options +
                                                        "\", means nothing to this daemon"};
    }
  }
  co_return co_await change(std::move(layer), reverts, terms, who);
}

awaitable<std::variant<PolicyKeeper::Change, PolicyKeeper::Refusal>> PolicyKeeper::change(
    std::optional<PolicyLayer> layer, std::optional<std::int64_t> reverts, proto::ChangeTerms terms, PeerIdentity who) {
  const auto begun = Clock::now();
  if (terms.if_version && *terms.if_version != static_cast<std::uint64_t>(version_)) {
    co_return Refusal{proto::ErrorCode::version_changed, "the rule's version is " + std::to_string(version_) +
                                                             ", not " + std::to_string(*terms.if_version)};
  }
  Change change;
  change.before = report();
  change.warnings = warnings(layer);
  store::RuleChange done{version_, store::seconds_since_1970(), std::nullopt, "", who.uid, who.pid, reverts};
  if (layer) {
    done.rule = layer->rule;
    done.options = scheduler::join_options(layer->options);
  }
  // What this daemon does not understand, or cannot read, is not there for it, but can be taken away.
  const bool is_foreign = last_ && last_->rule && !live_;
  const bool is_damaged = version_ > (last_ ? last_->number : 0);
  const bool same = layer == live_ && !is_foreign && !is_damaged &&
                    (changed_here_ || resolve(layer, When::after_restart).policy == policy());
  if (same) {
    change.after = change.before;
    co_return change;
  }
  if (!terms.dry_run) {
    const store::NewRuleChange row{done.rule, done.options, done.uid, done.pid, done.reverts};
    std::optional<std::int64_t> if_version;
    if (terms.if_version) if_version = static_cast<std::int64_t>(*terms.if_version);
    auto work = [row, if_version](store::MeshStore& store) { return store.rules().append(row, if_version); };
    const auto appended = co_await on_store(executor_, writer_, std::move(work));
    if (!appended) co_return refusal_of(appended.error());
    done = appended.value();
    // Of two changes at once the one that the database has as the later one holds.
    if (last_ && last_->number > done.number) {
      change.changed = true;
      change.would_change = true;
      change.after = report();
      co_return change;
    }
    change.before = report();  // another's change may have come before this one
  }
  const bool was_changed_here = std::exchange(changed_here_, true);
  auto resolved = resolve(layer, When::now);
  change.after = report_of(resolved, done);
  if (terms.dry_run) {
    changed_here_ = was_changed_here;
    change.would_change = true;
    co_return change;
  }
  live_ = std::move(layer);
  version_ = done.number;
  last_ = std::move(done);
  resolved_ = std::move(resolved);
  change.changed = true;
  change.would_change = true;
  apply_(resolved_.policy);
  change.seconds = std::chrono::duration<double>(Clock::now() - begun).count();
  co_return change;
}

awaitable<store::Result<store::RuleChanges>> PolicyKeeper::history(std::uint32_t most) {
  auto work = [most](store::MeshStore& store) {
    return store.rules().newest(most == 0 ? store::kMaxRuleChanges : most);
  };
  co_return co_await on_store(executor_, writer_, std::move(work));
}

}  // namespace pmcd::net
